// Files whose names do not tell their format, or tell it in capitals, and pipes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "generate/generate.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::double_positions;
using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Named {
  const char* fixture;
  const char* format;
};

class NamedFormat : public ::testing::TestWithParam<Named> {};
INSTANTIATE_TEST_SUITE_P(Files, NamedFormat,
                         ::testing::Values(Named{"roof.obj", "obj"}, Named{"tile.ply", ".ply"},
                                           Named{"mixed.su2", "SU2"}, Named{"deck.inp", ".INP"},
                                           Named{"plate.bdf", "nas"}),
                         [](const auto& param) {
                           return std::filesystem::path(param.param.fixture).stem().string();
                         });

TEST_P(NamedFormat, CountsBeforeTheExtension) {
  const Scratch scratch;
  MeshFile plain = read_mesh_file(fixture(GetParam().fixture));
  for (const char* name : {"mesh.dat", "mesh", "mesh.vtu"}) {
    std::filesystem::copy_file(fixture(GetParam().fixture), scratch.path(name));
    MeshFile file = read_mesh_file(scratch.path(name), GetParam().format);
    EXPECT_TRUE(file.mesh.positions == plain.mesh.positions) << name;
    double_positions(file.mesh);

    write_mesh_file(scratch.path(name), file, GetParam().format);

    EXPECT_TRUE(read_mesh_file(scratch.path(name), GetParam().format).mesh.positions ==
                file.mesh.positions)
        << name;
  }
  EXPECT_EQ(bytes_of(scratch.path("mesh")), bytes_of(scratch.path("mesh.vtu")));
}

TEST_P(NamedFormat, MayBeInCapitalsAsAnExtension) {
  const Scratch scratch;
  std::string name = GetParam().fixture;
  for (char& letter : name) letter = static_cast<char>(std::toupper(letter));
  std::filesystem::copy_file(fixture(GetParam().fixture), scratch.path(name));

  const MeshFile file = read_mesh_file(scratch.path(name));
  write_mesh_file(scratch.path("NEW" + name), file);

  EXPECT_EQ(bytes_of(scratch.path("NEW" + name)), bytes_of(fixture(GetParam().fixture)));
}

TEST_P(NamedFormat, IsReadFromAPipe) {
  const Scratch scratch;
  const auto pipe = scratch.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string bytes = bytes_of(fixture(GetParam().fixture));
  std::jthread writer([&] { put_bytes(pipe, bytes); });

  const MeshFile file = read_mesh_file(pipe, GetParam().format);

  EXPECT_TRUE(file.mesh.positions == read_mesh_file(fixture(GetParam().fixture)).mesh.positions);
}

TEST(NamedFormat, ThatIsUnknownIsSaid) {
  const Scratch scratch;
  std::filesystem::copy_file(fixture("roof.obj"), scratch.path("roof.dat"));
  std::filesystem::copy_file(fixture("roof.obj"), scratch.path("roof"));
  const auto error = [&](const char* name, const char* format) {
    const auto [reason, text] =
        error_of([&] { static_cast<void>(read_mesh_file(scratch.path(name), format)); });
    EXPECT_EQ(reason, "FORMAT_UNKNOWN");
    return text;
  };
  EXPECT_THAT(error("roof.dat", ""), HasSubstr("cannot read \".dat\" files"));
  EXPECT_THAT(error("roof", ""), HasSubstr("--format names it"));
  EXPECT_THAT(error("roof", "object"), HasSubstr("cannot read \"object\" files"));
}

TEST(NamedFormat, OfSeveralFilesIsNotReadFromAPipe) {
  const Scratch scratch;
  const auto pipe = scratch.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const char* format : {"node", "ele", "foam"}) {
    const auto [reason, text] = error_of([&] { static_cast<void>(read_mesh_file(pipe, format)); });
    EXPECT_EQ(reason, "FORMAT_UNKNOWN") << format;
    EXPECT_THAT(text, HasSubstr("so a pipe cannot carry them")) << format;
    EXPECT_EQ(error_of([&] { check_writable(pipe, ".node", format); }).first, "FORMAT_UNKNOWN");
  }
}

TEST(NamedFormat, ErrorsNameTheCallersFile) {
  const Scratch scratch;
  put_bytes(scratch.path("A.SU2"), "NDIME= 2\nNELEM= 1\n5 0 1 x\n");
  const auto [reason, text] =
      error_of([&] { static_cast<void>(read_mesh_file(scratch.path("A.SU2"))); });
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, AllOf(StartsWith(scratch.path("A.SU2").string() + ": line 3"),
                          HasSubstr("found \"x\"")));
}

TEST(Pairs, AreFoundInCapitals) {
  const Scratch scratch;
  std::filesystem::copy_file(fixture("tetgen.node"), scratch.path("MESH.NODE"));
  std::filesystem::copy_file(fixture("tetgen.ele"), scratch.path("MESH.ELE"));

  MeshFile file = read_mesh_file(scratch.path("MESH.ELE"));
  double_positions(file.mesh);
  write_mesh_file(scratch.path("MESH.NODE"), file);

  EXPECT_EQ(scratch.file_count(), 2U);
  EXPECT_TRUE(read_mesh_file(scratch.path("MESH.NODE")).mesh.positions == file.mesh.positions);
}

class ByteOrderMark : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Files, ByteOrderMark,
                         ::testing::Values("roof.obj", "tile.ply", "mixed.su2", "deck.inp",
                                           "parts.inp"),
                         [](const auto& param) {
                           return std::filesystem::path(param.param).stem().string();
                         });

TEST_P(ByteOrderMark, IsSkippedAndKept) {
  const Scratch scratch;
  const std::string name = GetParam();
  const std::string bytes = "\xEF\xBB\xBF" + bytes_of(fixture(name));
  put_bytes(scratch.path(name), bytes);

  const MeshFile file = read_mesh_file(scratch.path(name));
  write_mesh_file(scratch.path("new." + name), file);

  EXPECT_TRUE(file.mesh.positions == read_mesh_file(fixture(name)).mesh.positions);
  EXPECT_EQ(bytes_of(scratch.path("new." + name)), bytes);
}

}  // namespace
}  // namespace meshsmooth::formats
