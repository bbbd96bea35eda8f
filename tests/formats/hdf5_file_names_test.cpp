// HDF5 and netCDF files: compressed, in capitals, from pipes, and on a full disk.

#include "any_file.hpp"

namespace meshsmooth::formats {
namespace {

class ContainerFile : public ::testing::TestWithParam<const char*> {
 protected:
  const test::Scratch scratch_;
};
INSTANTIATE_TEST_SUITE_P(Files, ContainerFile,
                         ::testing::Values("assembly.med", "assembly.cgns", "assembly.exo",
                                           "compressed.e"),
                         [](const auto& param) {
                           return std::filesystem::path(param.param).extension().string().substr(1);
                         });

TEST_P(ContainerFile, IsTheSameByAnyName) {
  test::expect_same_by_any_name(scratch_, test::fixture(GetParam()));
}

TEST_P(ContainerFile, IsWholeOrNotThereOnAFullDisk) {
  test::expect_whole_or_not_at_all(scratch_, test::fixture(GetParam()));
}

}  // namespace
}  // namespace meshsmooth::formats
