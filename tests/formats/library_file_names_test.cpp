// Files of libraries that open them by their names: compressed, in capitals, from pipes, and on a
// full disk.

#include "any_file.hpp"
#include "generate/generate.hpp"

namespace meshsmooth::formats {
namespace {

class LibraryFile : public ::testing::TestWithParam<const char*> {
 protected:
  LibraryFile() {
    const std::string extension = GetParam();
    if (extension == ".msh" || extension == ".mesh" || extension == ".unv") {
      plain_ = test::fixture((extension == ".msh" ? "mixed" : "box") + extension);
    } else {
      const bool surface = extension == ".vtp" || extension == ".stl";
      write_mesh_file(plain_, MeshFile(surface ? generate_sphere(60, 1) : generate_mixed(60, 1)));
    }
  }

  const test::Scratch scratch_;
  std::filesystem::path plain_ = scratch_.path(std::string("plain") + GetParam());
};
INSTANTIATE_TEST_SUITE_P(Formats, LibraryFile,
                         ::testing::Values(".vtu", ".vtk", ".vtp", ".stl", ".msh", ".mesh", ".unv"),
                         [](const auto& param) { return std::string(param.param).substr(1); });

TEST_P(LibraryFile, IsTheSameByAnyName) { test::expect_same_by_any_name(scratch_, plain_); }

TEST_P(LibraryFile, IsNamedByErrors) {
  std::string name = GetParam();
  for (char& letter : name) letter = static_cast<char>(std::toupper(letter));
  test::expect_errors_to_name(scratch_.path("BAD" + name));
}

TEST_P(LibraryFile, IsWholeOrNotThereOnAFullDisk) {
  test::expect_whole_or_not_at_all(scratch_, plain_);
  const bool surface = plain_.extension() == ".vtp" || plain_.extension() == ".stl";
  const MeshFile other(surface ? generate_sphere(400, 1) : generate_mixed(400, 1));
  if (plain_.extension() == ".mesh" || plain_.extension() == ".unv") return;  // no wedges, pyramids
  test::expect_whole_or_not_at_all(scratch_, "other" + plain_.extension().string(), other);
}

}  // namespace
}  // namespace meshsmooth::formats
