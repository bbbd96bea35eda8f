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
  ComparedBy by;
  const char* word;     // somewhere in the file, outside the coordinates
  const char* changed;  // of the same length
};

void PrintTo(const Case& of, std::ostream* to) { *to << of.file; }

class CompareOwnFormats : public ::testing::TestWithParam<Case> {};

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

TEST_P(CompareOwnFormats, AnotherChangeIsSeen) {
  if (GetParam().word == nullptr) GTEST_SKIP() << "has no word to change";
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

INSTANTIATE_TEST_SUITE_P(
    All, CompareOwnFormats,
    ::testing::Values(Case{"deck.inp", ComparedBy::bytes, "*MATERIAL", "*Material"},
                      Case{"parts.inp", ComparedBy::bytes, "*Heading", "*heading"},
                      Case{"mixed.su2", ComparedBy::bytes, "MARKER_TAG= ", "MARKER_TAG=\t"},
                      Case{"foam", ComparedBy::arrays, nullptr, nullptr},
                      Case{"roof.obj", ComparedBy::bytes, "f ", "f\t"},
                      Case{"tetgen.node", ComparedBy::bytes, nullptr, nullptr},
                      Case{"assembly.med", ComparedBy::bytes, "wall", "hall"},
                      Case{"assembly.cgns", ComparedBy::bytes, "wall", "hall"},
                      Case{"assembly.exo", ComparedBy::bytes, "corners", "cornets"},
                      Case{"compressed.e", ComparedBy::bytes, nullptr, nullptr},
                      Case{"dolfinx.xdmf", ComparedBy::bytes, nullptr, nullptr},
                      Case{"mixed_meshio.xdmf", ComparedBy::bytes, nullptr, nullptr},
                      Case{"flat_inline.xdmf", ComparedBy::bytes, nullptr, nullptr}));

}  // namespace
}  // namespace meshsmooth::formats
