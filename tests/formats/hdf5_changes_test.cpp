// Of an HDF5 file that is written only the coordinates change: every object of it is compared.

#include <gmock/gmock.h>
#include <hdf5.h>

#include <algorithm>
#include <functional>
#include <map>

#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAreArray;

/// Every object of a file by its path: the names of its attributes with their bytes, its bytes and
/// its filters.
using Contents = std::map<std::string, std::string>;

std::string bytes_of_data(hid_t type, hid_t space, const std::function<herr_t(void*)>& read) {
  const auto count =
      static_cast<std::size_t>(std::max<hssize_t>(H5Sget_simple_extent_npoints(space), 0));
  if (H5Tdetect_class(type, H5T_VLEN) > 0 || H5Tis_variable_str(type) > 0) return "of any length";
  std::string bytes(H5Tget_size(type) * count + 1, '\0');
  EXPECT_GE(read(bytes.data()), 0);
  return bytes;
}

herr_t add_attribute(hid_t object, const char* name, const H5A_info_t*, void* text) {
  const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
  const hid_t type = H5Aget_type(attribute);
  const hid_t space = H5Aget_space(attribute);
  *static_cast<std::string*>(text) +=
      name + bytes_of_data(type, space, [&](void* to) { return H5Aread(attribute, type, to); });
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(attribute);
  return 0;
}

void add_objects(hid_t parent, const std::string& path, Contents& contents) {
  H5G_info_t group;
  ASSERT_GE(H5Gget_info(parent, &group), 0);
  for (hsize_t index = 0; index < group.nlinks; ++index) {
    char name[256];
    H5Lget_name_by_idx(parent, ".", H5_INDEX_NAME, H5_ITER_INC, index, name, sizeof name,
                       H5P_DEFAULT);
    const std::string child = path + "/" + name;
    const hid_t object = H5Oopen(parent, name, H5P_DEFAULT);
    std::string& text = contents[child];
    hsize_t first = 0;
    H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, &first, add_attribute, &text);
    if (H5Iget_type(object) == H5I_GROUP) {
      add_objects(object, child, contents);
    } else if (H5Iget_type(object) == H5I_DATASET) {
      const hid_t type = H5Dget_type(object);
      const hid_t space = H5Dget_space(object);
      const hid_t creation = H5Dget_create_plist(object);
      text += std::to_string(H5Pget_nfilters(creation)) + std::to_string(H5Pget_layout(creation)) +
              bytes_of_data(type, space, [&](void* to) {
                return H5Dread(object, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to);
              });
      H5Pclose(creation);
      H5Sclose(space);
      H5Tclose(type);
    }
    H5Oclose(object);
  }
}

Contents contents_of(const std::filesystem::path& path) {
  Contents contents;
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  EXPECT_GE(file, 0);
  add_objects(file, "", contents);
  H5Fclose(file);
  EXPECT_GT(contents.size(), 2U);
  return contents;
}

struct Case {
  const char* name;
  std::vector<const char*> coordinates;
};

class Hdf5Changes : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(
    Hdf5Formats, Hdf5Changes,
    ::testing::Values(Case{"assembly.med",
                           {"/ENS_MAA/assembly/-0000000000000000001-0000000000000000001/NOE/COO"}},
                      Case{"assembly.cgns",
                           {"/assembly.cgns/assembly_Part0/GridCoordinates/CoordinateX/ data",
                            "/assembly.cgns/assembly_Part0/GridCoordinates/CoordinateY/ data",
                            "/assembly.cgns/assembly_Part0/GridCoordinates/CoordinateZ/ data"}},
                      Case{"zones.cgns",
                           {"/Base/left/GridCoordinates/CoordinateX/ data",
                            "/Base/left/GridCoordinates/CoordinateY/ data",
                            "/Base/left/GridCoordinates/CoordinateZ/ data",
                            "/Base/right/GridCoordinates/CoordinateX/ data",
                            "/Base/right/GridCoordinates/CoordinateY/ data",
                            "/Base/right/GridCoordinates/CoordinateZ/ data"}},
                      Case{"compressed.e", {"/coordx", "/coordy", "/coordz"}},
                      Case{"mixed_meshio.xdmf", {"/data0"}},
                      Case{"dolfinx.xdmf", {"/Mesh/mesh/geometry"}}),
    [](const auto& param) {
      std::string name = param.param.name;
      std::ranges::replace(name, '.', '_');
      return name;
    });

TEST_P(Hdf5Changes, AreThoseOfTheCoordinatesAlone) {
  const Scratch scratch;
  const std::string extension = std::filesystem::path(GetParam().name).extension();
  MeshFile file = read_mesh_file(fixture(GetParam().name));
  test::move_nodes(file.mesh);

  write_mesh_file(scratch.path("out" + extension), file);

  const bool pair = extension == ".xdmf";
  const auto before = contents_of(pair ? fixture(GetParam().name).replace_extension(".h5")
                                       : fixture(GetParam().name));
  const auto after = contents_of(scratch.path(pair ? "out.h5" : "out" + extension));
  ASSERT_EQ(before.size(), after.size());
  std::vector<std::string> changed;
  for (const auto& [name, text] : before) {
    ASSERT_TRUE(after.contains(name)) << name;
    if (after.at(name) != text) changed.push_back(name);
  }
  EXPECT_THAT(changed, ElementsAreArray(GetParam().coordinates));
}

}  // namespace
}  // namespace meshsmooth::formats
