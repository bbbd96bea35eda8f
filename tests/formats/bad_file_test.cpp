// Files that are cut off, are no mesh, or cannot be written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <algorithm>

#include <unistd.h>

#include <random>

#include "generate/generate.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<const char*> every_format() {
  std::vector<const char*> formats = {".vtu", ".vtk",  ".vtp", ".ply", ".stl",
                                      ".obj", ".node", ".ele", ".bdf"};
#if defined(MESHSMOOTH_WITH_GMSH)
  formats.insert(formats.end(), {".msh", ".mesh", ".unv"});
#endif
  return formats;
}

class EveryFormat : public ::testing::TestWithParam<const char*> {
 protected:
  /// A good file of the format under test.
  std::filesystem::path good() {
    const std::string extension = GetParam();
    const auto path = scratch_.path("good" + extension);
    if (extension == ".node" || extension == ".ele") {
      std::filesystem::copy_file(fixture("tetgen.node"), scratch_.path("good.node"));
      std::filesystem::copy_file(fixture("tetgen.ele"), scratch_.path("good.ele"));
    } else if (extension == ".mesh" || extension == ".unv" || extension == ".bdf") {
      std::filesystem::copy_file(fixture(extension == ".bdf" ? "plate.bdf" : "box" + extension),
                                 path);
    } else {
      const bool volume = extension == ".vtu" || extension == ".vtk" || extension == ".msh";
      write_mesh_file(path, MeshFile(volume ? generate_mixed(60, 1) : generate_sphere(60, 1)));
    }
    return path;
  }
  std::string reason_of_reading(const std::filesystem::path& path) {
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    const auto [reason, text] = error_of([&] { (void)read_mesh_file(path); });
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");  // libraries are kept quiet
    if (!reason.empty()) {
      EXPECT_THAT(text, StartsWith(scratch_.path("").string()));
      EXPECT_THAT(text, Not(HasSubstr("\n")));
    }
    return reason;
  }
  Scratch scratch_;
};

INSTANTIATE_TEST_SUITE_P(BadFile, EveryFormat, ::testing::ValuesIn(every_format()),
                         [](const auto& param) { return std::string(param.param).substr(1); });

// A cut is an error wherever it falls. OBJ and Nastran say nowhere how much is to come: only
// a cut within the nodes or in the middle of a line can be seen.
TEST_P(EveryFormat, RefusesAFileThatWasCutOff) {
  const std::string bytes = bytes_of(good());
  const auto path = scratch_.path(std::string("good") + GetParam());
  const std::string extension = GetParam();
  // TetGen's files end with a comment.
  const double latest = extension == ".obj"                           ? 0.4
                        : extension == ".bdf"                         ? 0.7
                        : extension == ".node" || extension == ".ele" ? 0.85
                                                                      : 0.97;
  for (double share = 0.01; share < latest; share += 0.06) {
    put_bytes(path, bytes.substr(0, static_cast<std::size_t>(share * double(bytes.size()))));
    EXPECT_THAT(reason_of_reading(path), AnyOf("FILE_TRUNCATED", "FORMAT_ERROR", "MESH_EMPTY"))
        << "cut to " << share;
  }
}

TEST_P(EveryFormat, RefusesAFileOfSomethingElse) {
  (void)good();
  const auto path = scratch_.path(std::string("good") + GetParam());
  std::mt19937 random(1);
  std::string noise(5000, ' ');
  for (char& byte : noise) byte = static_cast<char>(random());
  put_bytes(path, noise);
  EXPECT_THAT(reason_of_reading(path), AnyOf("FORMAT_ERROR", "FILE_TRUNCATED"));
  put_bytes(path, "Dear reader,\nthis is a letter and no mesh.\n");
  EXPECT_THAT(reason_of_reading(path), AnyOf("FORMAT_ERROR", "FILE_TRUNCATED", "MESH_EMPTY"));
  put_bytes(path, "");
  EXPECT_EQ(reason_of_reading(path), "FILE_TRUNCATED");
}

TEST_P(EveryFormat, SaysThatAFileIsNotThere) {
  const auto path = scratch_.path(std::string("nowhere") + GetParam());
  EXPECT_EQ(reason_of_reading(path), "FILE_NOT_FOUND");
}

#if defined(MESHSMOOTH_WITH_GMSH)

TEST(BadFile, NamesAnElementOfHigherOrder) {
  const Scratch scratch;
  std::string nodes;
  for (int node = 1; node <= 14; ++node) {
    nodes += std::to_string(node) + " 0 1 " + std::to_string(node) + "\n";
  }
  const auto error_with = [&](const std::string& element) {
    put_bytes(scratch.path("a.msh"), "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n14\n" + nodes +
                                         "$EndNodes\n$Elements\n" +
                                         std::to_string(1 + std::ranges::count(element, '\n')) +
                                         "\n" + element + "\n$EndElements\n");
    return error_of([&] { (void)read_mesh_file(scratch.path("a.msh")); });
  };
  const auto [reason, text] = error_with("5 21 2 1 1 1 2 3 4 5 6 7 8 9 10");
  EXPECT_EQ(reason, "MESH_EMPTY");
  EXPECT_THAT(text, HasSubstr("cells of the type Triangle 10; only linear"));
  EXPECT_THAT(error_with("5 14 2 1 1 1 2 3 4 5 6 7 8 9 10 11 12 13 14\n6 2 2 1 1 1 2 3").second,
              HasSubstr("it has 1 cells of the type Pyramid 14"));
}

// Gmsh runs files that it does not know as scripts.
TEST(BadFile, IsNeverRunAsAScript) {
  const Scratch scratch;
  const auto trace = scratch.path("trace");
  const std::string script = "SystemCall \"touch " + trace.string() + "\";\n";
  for (const char* name : {"a.msh", "a.mesh", "a.unv", "a.bdf", "a.MESH", "a.Msh"}) {
    put_bytes(scratch.path(name), script + "$MeshFormat\nMeshVersionFormatted 2\nENDDATA\n");
    EXPECT_NE(error_of([&] { (void)read_mesh_file(scratch.path(name)); }).first, "");
  }
  EXPECT_FALSE(std::filesystem::exists(trace));
}

#endif

TEST(BadFile, NamesALagrangeElement) {
  const Scratch scratch;
  put_bytes(
      scratch.path("a.vtk"),
      "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n" +
          [] {
            std::string rows;
            for (int node = 0; node < 10; ++node) rows += std::to_string(node) + " 0 1\n";
            return rows;
          }() +
          "CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n71\n");
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.vtk")); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("element 0 is of the type lagrange tetra"));
}

TEST(BadFile, NamesTheLineInATextFile) {
  const Scratch scratch;
  put_bytes(scratch.path("a.node"), "2 3 0 0\n1 0 0 0\n2 zero 0 0\n");
  put_bytes(scratch.path("a.ele"), "0 4 0\n");
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.node")); });
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, HasSubstr("line 3: expected a number, found \"zero\""));
}

TEST(BadFile, HasNoSurfaceOrVolumeElements) {
  const Scratch scratch;
  put_bytes(scratch.path("a.obj"), "v 0 0 0\nv 1 0 0\nl 1 2\n");
  EXPECT_EQ(error_of([&] { (void)read_mesh_file(scratch.path("a.obj")); }).first, "MESH_EMPTY");
}

TEST(BadFile, IsOfAnUnknownFormat) {
  const Scratch scratch;
  put_bytes(scratch.path("a.step"), "x");
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.step")); });
  EXPECT_EQ(reason, "FORMAT_UNKNOWN");
  EXPECT_THAT(text, HasSubstr(".vtu"));
}

TEST(CheckWritable, FindsWhatWouldFailAndLeavesNothingBehind) {
  const Scratch scratch;
  const auto reason = [](const std::filesystem::path& path) {
    return error_of([&] { check_writable(path); }).first;
  };
  EXPECT_EQ(reason(scratch.path("a.vtu")), "");
  EXPECT_EQ(reason(scratch.path("a.step")), "FORMAT_UNKNOWN");
  EXPECT_EQ(reason(scratch.path("no/such/folder.vtu")), "FILE_NOT_WRITABLE");
  std::filesystem::create_directory(scratch.path("folder.vtu"));
  EXPECT_EQ(reason(scratch.path("folder.vtu")), "FILE_NOT_WRITABLE");
  EXPECT_EQ(scratch.file_count(), 1u);
}

TEST(CheckWritable, RefusesAFolderWithoutPermission) {
  if (::geteuid() == 0) GTEST_SKIP() << "nothing is forbidden to root";
  const Scratch scratch;
  const auto folder = scratch.path("locked");
  std::filesystem::create_directory(folder);
  std::filesystem::permissions(folder, std::filesystem::perms::owner_read);
  EXPECT_EQ(error_of([&] { check_writable(folder / "a.vtu"); }).first, "FILE_NOT_WRITABLE");
}

}  // namespace
}  // namespace meshsmooth::formats
