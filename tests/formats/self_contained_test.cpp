#include <gmock/gmock.h>
#include <gtest/gtest.h>

#if defined(MESHSMOOTH_WITH_HDF5)
#include <hdf5.h>
#endif

#include <filesystem>
#include <string>

#include "mesh_file.hpp"
#include "meshsmooth/error.hpp"
#include "self_contained.hpp"
#include "support/scratch_folder.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using ::testing::HasSubstr;

/// A stranger's file in a folder of its own, and beside it one that it must not reach.
class SelfContained : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = folder_.path(name);
    std::filesystem::create_directories(path.parent_path());
    write_bytes(path, text);
    return path;
  }
  static void expect_refused(const std::filesystem::path& file, const std::string& other) {
    try {
      const SelfContainedReading scope(file);
      (void)read_mesh_file(file);
      ADD_FAILURE() << file << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.reason(), "REFERENCE_REFUSED") << error.what();
      EXPECT_THAT(error.what(), HasSubstr(other));
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
    }
  }

  meshsmooth::testing::ScratchFolder folder_;
};

constexpr const char* kTetrahedron =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";

TEST_F(SelfContained, ReadsAFileThatRefersToNone) {
  for (const char* name : {"part.inp", "PART.INP"}) {  // the second one from a copy
    const std::filesystem::path file = write(name, kTetrahedron);
    const SelfContainedReading scope(file);
    EXPECT_EQ(read_mesh_file(file).mesh.element_count(), 1u);
  }
}

TEST_F(SelfContained, RefusesIncludedFilesWithoutALookWhetherTheyAreThere) {
  write("nodes.inc", kTetrahedron);
  expect_refused(write("a.inp", "*INCLUDE, INPUT=nodes.inc\n"), "nodes.inc");
  expect_refused(write("b.inp", "*NODE, INPUT=/etc/hostname\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n"),
                 "/etc/hostname");
  expect_refused(write("c.inp", "*INCLUDE, INPUT=/no/such/file\n"), "/no/such/file");
  expect_refused(write("d.bdf", "BEGIN BULK\nINCLUDE 'nodes.inc'\nENDDATA\n"), "nodes.inc");
  EXPECT_EQ(read_mesh_file(folder_.path("a.inp")).mesh.element_count(), 1u);  // on its own disk
}

TEST_F(SelfContained, RefusesFormatsOfSeveralFiles) {
  expect_refused(write("ball.node", "1 3 0 0\n1 0 0 0\n"), "ball.ele");
  write("constant/polyMesh/points", "");
  expect_refused(write("case.foam", "x"), "polyMesh");
#if defined(MESHSMOOTH_WITH_HDF5)
  expect_refused(
      write("grid.xdmf",
            "<Xdmf Version=\"3.0\"><Domain><Grid><Topology TopologyType=\"Triangle\" "
            "NumberOfElements=\"1\"><DataItem Dimensions=\"1 3\" NumberType=\"Int\" "
            "Format=\"HDF\">other.h5:/t</DataItem></Topology><Geometry GeometryType=\"XYZ\">"
            "<DataItem Dimensions=\"3 3\" Format=\"HDF\">other.h5:/g</DataItem></Geometry>"
            "</Grid></Domain></Xdmf>"),
      "other.h5");
#endif
}

#if defined(MESHSMOOTH_WITH_HDF5)
TEST_F(SelfContained, ExodusFilesHaveTheirDataInThemselves) {
  const std::filesystem::path secret = write("secret", std::string(800, 'x'));
  const std::filesystem::path path = folder_.path("mesh.exo");
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t size = 100;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_external(creation, secret.c_str(), 0, 800);
  H5Dclose(H5Dcreate2(file, "coordx", H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Pclose(creation);
  H5Sclose(space);
  H5Fclose(file);
  try {
    (void)read_mesh_file(path);
    ADD_FAILURE() << "it was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another file"));
  }
}
#endif

}  // namespace
}  // namespace meshsmooth::formats
