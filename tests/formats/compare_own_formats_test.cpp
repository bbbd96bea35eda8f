// A file that was read, moved and written differs from the first in its coordinates alone, and
// `compare_files` says so; of any other change it says that there is one. Formats of libraries have
// their test in tests/cli/compare_test.py.

#include <gmock/gmock.h>

#include "compare.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::IsEmpty;

struct Case {
  const char* file;
  ComparedBy by = ComparedBy::bytes;
};

struct Change {
  const char* file;
  const char* word;  // somewhere in the file, outside the coordinates
  const char* changed;
};

void PrintTo(const Case& of, std::ostream* to) { *to << of.file; }
void PrintTo(const Change& of, std::ostream* to) { *to << of.file; }

class CompareOwnFormats : public ::testing::TestWithParam<Case> {};
class CompareChangedFiles : public ::testing::TestWithParam<Change> {};

/// One coordinate of one node, which every format can write, whatever its digits.
void move_a_node(Mesh& mesh) {
  std::visit([](auto& nodes) { nodes.front().x += 0.0625F; }, mesh.positions);
}

TEST_P(CompareOwnFormats, CoordinatesAloneDiffer) {
  const Scratch scratch;
  const std::filesystem::path from = fixture(GetParam().file);
  const std::filesystem::path to =
      std::filesystem::is_directory(from) ? scratch.path("case/") : scratch.path(from.filename());
  const MeshFile before = read_mesh_file(from);
  MeshFile moved = before;
  move_a_node(moved.mesh);
  write_mesh_file(to, moved);
  const FileDifference difference = compare_files(before, read_mesh_file(to));
  EXPECT_THAT(difference.differences, IsEmpty());
  EXPECT_TRUE(difference.same_topology);
  EXPECT_EQ(compared_by_name(difference.compared_by), compared_by_name(GetParam().by));
}

TEST_P(CompareChangedFiles, AnotherChangeIsSeen) {
  const Scratch scratch;
  const std::filesystem::path from = fixture(GetParam().file);
  const std::filesystem::path to = scratch.path(from.filename());
  std::string bytes = bytes_of(from);
  const std::size_t place = bytes.find(GetParam().word);
  ASSERT_NE(place, std::string::npos);
  bytes.replace(place, std::string_view(GetParam().changed).size(), GetParam().changed);
  put_bytes(to, bytes);
  const FileDifference difference = compare_files(read_mesh_file(from), read_mesh_file(to));
  EXPECT_FALSE(difference.only_coordinates());
}

INSTANTIATE_TEST_SUITE_P(All, CompareOwnFormats,
                         ::testing::Values(Case{"deck.inp"}, Case{"parts.inp"}, Case{"mixed.su2"},
                                           Case{"foam", ComparedBy::arrays}, Case{"roof.obj"},
                                           Case{"tile.ply"}, Case{"tetgen.node"},
                                           Case{"assembly.med"}, Case{"assembly.cgns"},
                                           Case{"assembly.exo"}, Case{"compressed.e"},
                                           Case{"dolfinx.xdmf"}, Case{"mixed_meshio.xdmf"},
                                           Case{"flat_inline.xdmf"}));

INSTANTIATE_TEST_SUITE_P(All, CompareChangedFiles,
                         ::testing::Values(Change{"deck.inp", "*MATERIAL", "*Material"},
                                           Change{"parts.inp", "*Heading", "*heading"},
                                           Change{"mixed.su2", "MARKER_TAG= ", "MARKER_TAG=\t"},
                                           Change{"roof.obj", "f ", "f\t"},
                                           Change{"assembly.med", "wall", "hall"},
                                           Change{"assembly.cgns", "wall", "hall"},
                                           Change{"assembly.exo", "corners", "cornets"}));

}  // namespace
}  // namespace meshsmooth::formats
