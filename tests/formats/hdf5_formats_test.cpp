// MED, CGNS, Exodus and XDMF: files of other programs (files/make_hdf5_files.py) read and written.

#include <gmock/gmock.h>

#include <cstring>
#include <random>
#include <set>

#include "generate/generate.hpp"
#include "node_sets.hpp"
#include "regions.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

/// A file, with its .h5 file where it has one, in a folder of its own.
std::filesystem::path copied(const Scratch& scratch, const std::string& name) {
  const std::string pair = std::filesystem::path(name).stem().string() + ".h5";
  if (name.ends_with(".xdmf") && std::filesystem::exists(fixture(pair))) {
    put_bytes(scratch.path(pair), bytes_of(fixture(pair)));
  }
  put_bytes(scratch.path(name), bytes_of(fixture(name)));
  return scratch.path(name);
}

/// The nodes by their places in the list of points from which the files were made, for Gmsh
/// numbers them anew.
std::vector<NodeId> named(const Mesh& mesh, std::vector<NodeId> nodes) {
  constexpr double kPoints[][3] = {{0, 0, 0},   {1, 0, 0},  {1, 1, 0},  {0, 1, 0},
                                   {0, 0, 1},   {1, 0, 1},  {1, 1, 1},  {0, 1, 1},
                                   {.5, .5, 2}, {2, 0, .5}, {2, 1, .5}, {2, .5, 1.5}};
  for (NodeId& node : nodes) {
    const Vec3d place = std::visit(
        [&](const auto& all) { return vec3_cast<double>(all[static_cast<std::size_t>(node)]); },
        mesh.positions);
    const auto* found = std::ranges::find_if(kPoints, [&](const auto& point) {
      return point[0] == place.x && point[1] == place.y && point[2] == place.z;
    });
    node = static_cast<NodeId>(found - std::begin(kPoints));
  }
  return nodes;
}

/// The nodes of a set, in the same way, ascending.
std::vector<NodeId> set_of(const MeshFile& file, const std::string& name) {
  std::vector<NodeId> nodes = named(file.mesh, find_node_set(file, name));
  std::ranges::sort(nodes);
  return nodes;
}

/// The elements in VTK's order, of the whole file, in the same way.
std::set<std::vector<NodeId>> elements_of(const Mesh& mesh) {
  std::set<std::vector<NodeId>> elements;
  for (const ElementBlock& block : mesh.blocks) {
    const auto corners = element_width(block.type);
    for (std::size_t first = 0; first < block.nodes.size(); first += corners) {
      const auto begin = block.nodes.begin() + static_cast<std::ptrdiff_t>(first);
      elements.insert(named(mesh, {begin, begin + static_cast<std::ptrdiff_t>(corners)}));
    }
  }
  return elements;
}

class EveryHdf5File : public ::testing::TestWithParam<const char*> {
 protected:
  const Scratch scratch_;
};
INSTANTIATE_TEST_SUITE_P(Hdf5Formats, EveryHdf5File,
                         ::testing::Values("assembly.med", "assembly.cgns", "assembly.exo",
                                           "compressed.e", "mixed_meshio.xdmf", "dolfinx.xdmf",
                                           "flat_inline.xdmf", "second_order.med",
                                           "second_order.cgns", "second_order.exo",
                                           "second_order.xdmf", "zones.cgns", "zones_adf.cgns",
                                           "polyhedra.cgns", "polyhedra_adf.cgns", "polyhedra.exo",
                                           "shells.exo", "polyhedra.med", "checkpoint.xdmf"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

class Assembly : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Hdf5Formats, Assembly,
                         ::testing::Values("assembly.med", "assembly.cgns", "assembly.exo",
                                           "compressed.e", "mixed_meshio.xdmf"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST_P(Assembly, HasItsElementsInTheOrderOfVtk) {
  const MeshFile file = read_mesh_file(fixture(GetParam()));

  EXPECT_EQ(file.mesh.node_count(), 12U);
  EXPECT_THAT(elements_of(file.mesh),
              UnorderedElementsAre(ElementsAre(0, 1, 2, 3, 4, 5, 6, 7), ElementsAre(4, 5, 6, 7, 8),
                                   ElementsAre(1, 9, 5, 2, 10, 6), ElementsAre(5, 6, 8, 11)));
  const bool single = std::holds_alternative<std::vector<Vec3f>>(file.mesh.positions);
  EXPECT_EQ(single, std::string(GetParam()) == "compressed.e" ||
                        std::string(GetParam()) == "mixed_meshio.xdmf");
}

TEST_P(EveryHdf5File, KeepsItsBytesWhereNothingMoved) {
  const std::string extension = std::filesystem::path(GetParam()).extension();
  const auto path = copied(scratch_, GetParam());
  const MeshFile file = read_mesh_file(path);

  write_mesh_file(scratch_.path("out" + extension), file);

  std::string expected = bytes_of(path);
  if (const auto pair = std::filesystem::path(path).replace_extension(".h5");
      std::filesystem::exists(pair)) {
    EXPECT_EQ(bytes_of(scratch_.path("out.h5")), bytes_of(pair));
    const std::string old_name = pair.filename().string() + ":";
    for (auto at = expected.find(old_name); at != std::string::npos; at = expected.find(old_name)) {
      expected.replace(at, old_name.size(), "out.h5:");
    }
  }
  EXPECT_EQ(bytes_of(scratch_.path("out" + extension)), expected);
}

TEST_P(EveryHdf5File, GivesBackPositionsThatMoved) {
  const std::string extension = std::filesystem::path(GetParam()).extension();
  MeshFile file = read_mesh_file(copied(scratch_, GetParam()));
  test::move_nodes(file.mesh);
  const std::string name = GetParam();
  if (name == "flat_inline.xdmf" || name == "checkpoint.xdmf") {
    for (Vec3d& node : std::get<std::vector<Vec3d>>(file.mesh.positions)) node.z = 0;
  }

  write_mesh_file(scratch_.path("out" + extension), file);

  const MeshFile again = read_mesh_file(scratch_.path("out" + extension));
  EXPECT_TRUE(again.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(again.mesh, file.mesh);
}

TEST_P(EveryHdf5File, IsReplacedInItsPlace) {
  const auto path = copied(scratch_, GetParam());
  MeshFile file = read_mesh_file(path);
  std::visit([](auto& nodes) { nodes[0].x = 0.125F; }, file.mesh.positions);
  const std::size_t files = scratch_.file_count();

  write_mesh_file(path, file);

  EXPECT_TRUE(read_mesh_file(path).mesh.positions == file.mesh.positions);
  EXPECT_EQ(scratch_.file_count(), files);
}

TEST_P(EveryHdf5File, IsWrittenFromItsOwnFormatOnly) {
  const std::string extension = std::filesystem::path(GetParam()).extension();
  const auto path = scratch_.path("out" + extension);
  const auto [reason, text] =
      error_of([&] { write_mesh_file(path, MeshFile(generate_mixed(60, 1))); });
  EXPECT_EQ(reason, "FORMAT_UNKNOWN");
  EXPECT_THAT(text, HasSubstr("written only with the contents of a file of the same format"));
  EXPECT_EQ(error_of([&] { check_writable(path, "in.obj"); }).first, "FORMAT_UNKNOWN");
  EXPECT_EQ(error_of([&] { check_writable(path, fixture(GetParam())); }).first, "");
}

// What HDF5 and netCDF do not notice must still be a mesh or an `Error`.
TEST_P(EveryHdf5File, IsReadOrRefusedWhereverItIsCutOff) {
  const auto path = copied(scratch_, GetParam());
  for (const auto& each : {path, std::filesystem::path(path).replace_extension(".h5")}) {
    if (!std::filesystem::exists(each)) continue;
    const std::string bytes = bytes_of(each);
    // At its end an ADF file has free space.
    const double last = path.string().ends_with("_adf.cgns") ? 0.75 : 0.99;
    for (double share = 0.01; share < last; share += 0.035) {
      put_bytes(each, bytes.substr(0, static_cast<std::size_t>(share * double(bytes.size()))));
      const auto [reason, text] = error_of([&] { (void)read_mesh_file(path); });
      EXPECT_THAT(reason, AnyOf("FILE_TRUNCATED", "FORMAT_ERROR")) << share << ": " << text;
      EXPECT_THAT(text, StartsWith(scratch_.path("").string()));
    }
    put_bytes(each, bytes);
  }
}

TEST_P(EveryHdf5File, IsReadOrRefusedWithBytesThatAreWrong) {
  const auto path = copied(scratch_, GetParam());
  const auto pair = std::filesystem::path(path).replace_extension(".h5");
  const auto victim = std::filesystem::exists(pair) ? pair : path;
  const std::string bytes = bytes_of(victim);
  std::mt19937 random(5);
  for (int attempt = 0; attempt < 60; ++attempt) {
    std::string changed = bytes;
    for (int count = 0; count < 4; ++count) {
      changed[random() % changed.size()] = static_cast<char>(random());
    }
    put_bytes(victim, changed);
    try {
      MeshFile file = read_mesh_file(path);
      write_mesh_file(scratch_.path("out" + path.extension().string()), file);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), StartsWith(scratch_.path("").string()));
    }
  }
}

TEST(MedFile, HasGroupsAndFamilies) {
  const MeshFile file = read_mesh_file(fixture("assembly.med"));

  EXPECT_THAT(set_of(file, "wall"), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(set_of(file, "tip"), ElementsAre(6, 8, 11));
  EXPECT_THAT(set_of(file, "corners"), ElementsAre(0, 8));
  EXPECT_THAT(set_of(file, "air"), ElementsAre(4, 5, 6, 7, 8, 11));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "med:family");
  EXPECT_EQ(regions.count, 2U);
  EXPECT_EQ(file.file_node_id(0), 1);
}

TEST(CgnsFile, HasBoundaryConditionsFamiliesAndSections) {
  const MeshFile file = read_mesh_file(fixture("assembly.cgns"));

  for (const char* name : {"wall", "S_1", "4_S_1"}) {
    EXPECT_THAT(set_of(file, name), ElementsAre(0, 1, 2, 3)) << name;
  }
  EXPECT_THAT(set_of(file, "air"), ElementsAre(4, 5, 6, 7, 8, 11));
  EXPECT_EQ(find_regions(file).array, "") << "sections are of one type each";
  EXPECT_EQ(find_regions(file, "cgns:section").count, 4U);
}

TEST(ExodusFile, HasSetsBlocksAndNumbers) {
  for (const char* name : {"assembly.exo", "compressed.e"}) {
    const MeshFile file = read_mesh_file(fixture(name));

    EXPECT_THAT(set_of(file, "corners"), ElementsAre(0, 8));
    EXPECT_THAT(set_of(file, "nodeset_5"), ElementsAre(3));
    EXPECT_THAT(set_of(file, "wall"), ElementsAre(0, 1, 2, 3));
    EXPECT_THAT(set_of(file, "skin"), ElementsAre(1, 5, 6, 8, 9, 11));
    EXPECT_THAT(set_of(file, "air"), ElementsAre(4, 5, 6, 7, 8));
    EXPECT_THAT(set_of(file, "block_21"), ElementsAre(5, 6, 8, 11));
    const Regions regions = find_regions(file);
    EXPECT_EQ(regions.array, "exodus:block");
    EXPECT_EQ(regions.count, 4U);
    EXPECT_EQ(file.file_node_id(3), 103);
    EXPECT_EQ(file.file_element_id(0), 7);
  }
}

// netCDF would fill up the written file to that length, with zeros.
TEST(ExodusFile, IsRefusedWhereItTellsOfMoreRecordsThanItHolds) {
  const Scratch scratch;
  const auto path = scratch.path("in.exo");
  std::string bytes = bytes_of(fixture("assembly.exo"));
  put_bytes(path, bytes);
  EXPECT_EQ(error_of([&] { (void)read_mesh_file(path); }).first, "");
  bytes.replace(4, 4, std::string(4, '\x7f'));
  put_bytes(path, bytes);
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(path); });
  EXPECT_EQ(reason, "FILE_TRUNCATED");
  EXPECT_THAT(text, HasSubstr("ends before the values that its header tells of, of 2139062143"));
}

// netCDF 4.9 divides by zero as it opens them.
TEST(ExodusFile, IsRefusedWhereAVariableHasNoSize) {
  const Scratch scratch;
  const auto path = scratch.path("in.exo");
  const std::string bytes = bytes_of(fixture("assembly.exo"));
  const auto error_with = [&](std::size_t at, char byte) {
    std::string changed = bytes;
    changed[at] = byte;
    put_bytes(path, changed);
    return error_of([&] { (void)read_mesh_file(path); });
  };
  // "coordx", which is padded to 8 bytes: how many dimensions, which, no attributes, type.
  const std::size_t name = bytes.find("coordx");
  ASSERT_EQ(bytes[name + 11], 1) << "one dimension";
  EXPECT_THAT(error_with(name + 8 + 4 + 4 + 8 + 3, 0).second, HasSubstr("has an unknown type"));
  // "connect1", of the elements and their nodes.
  const std::size_t nodes = bytes.find("connect1");
  ASSERT_EQ(bytes[nodes + 11], 2) << "two dimensions";
  const std::size_t steps = bytes.find("time_step");
  ASSERT_NE(steps, std::string::npos);
  const auto [reason, text] = error_with(nodes + 8 + 4 + 4 + 3, 8);  // time_step
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, HasSubstr("has records in a dimension that is not its first"));
}

TEST(XdmfFile, HasMeshiosArrays) {
  const MeshFile file = read_mesh_file(fixture("mixed_meshio.xdmf"));

  EXPECT_EQ(find_regions(file).array, "gmsh:physical");
  EXPECT_EQ(find_regions(file).count, 2U);
  EXPECT_EQ(find_node_set(file, "temperature").size(), 11U) << "all but node 0";
}

TEST(XdmfFile, HasDolfinxTags) {
  const MeshFile file = read_mesh_file(fixture("dolfinx.xdmf"));

  const std::vector<NodeId> walls = find_node_set(file, "walls:3");
  EXPECT_EQ(walls.size(), 4U);
  for (const NodeId node : walls) {
    EXPECT_EQ(std::get<std::vector<Vec3d>>(file.mesh.positions)[static_cast<std::size_t>(node)].x,
              0);
  }
  EXPECT_EQ(find_regions(file, "parts").count, 2U);
  EXPECT_EQ(find_regions(file).array, "");
}

TEST(XdmfFile, NeedsItsHdf5File) {
  const Scratch scratch;
  put_bytes(scratch.path("dolfinx.xdmf"), bytes_of(fixture("dolfinx.xdmf")));
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("dolfinx.xdmf")); });
  EXPECT_EQ(reason, "FILE_NOT_FOUND");
  EXPECT_THAT(text, HasSubstr("its HDF5 file \"dolfinx.h5\" is not there"));
}

TEST(XdmfFile, TakesFormatsInAnyCase) {
  const Scratch scratch;
  std::string text = bytes_of(fixture("dolfinx.xdmf"));
  for (std::size_t at = 0; (at = text.find("Format=\"HDF\"", at)) != std::string::npos;) {
    text.replace(at, 12, "Format=\"hdf\"");
  }
  put_bytes(scratch.path("a.xdmf"), text);
  put_bytes(scratch.path("dolfinx.h5"), bytes_of(fixture("dolfinx.h5")));
  EXPECT_EQ(read_mesh_file(scratch.path("a.xdmf")).mesh.element_count(),
            read_mesh_file(fixture("dolfinx.xdmf")).mesh.element_count());
}

TEST(XdmfFile, RefusesWhatItCannotKeep) {
  const Scratch scratch;
  const std::string good = bytes_of(fixture("flat_inline.xdmf"));
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    put_bytes(scratch.path("a.xdmf"), text);
    return error_of([&] { (void)read_mesh_file(scratch.path("a.xdmf")); });
  };
  EXPECT_EQ(refused("\"Triangle\"", "\"Triangle_6\"").first, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(refused("\"XY\"", "\"ORIGIN_DXDYDZ\"").second, HasSubstr("XYZ and XY can be read"));
  EXPECT_THAT(refused("Format=\"XML\"", "Format=\"Binary\"").second, HasSubstr("\"Binary\""));
  EXPECT_THAT(refused("<Xdmf", "<!DOCTYPE a [<!ENTITY b 'c'>]><Xdmf").second,
              HasSubstr("entities are not supported"));
  MeshFile file = read_mesh_file(fixture("flat_inline.xdmf"));
  std::get<std::vector<Vec3d>>(file.mesh.positions)[4].z = 0.5;
  const auto [reason, text] = error_of([&] { write_mesh_file(scratch.path("b.xdmf"), file); });
  EXPECT_EQ(reason, "FILE_NOT_WRITABLE");
  EXPECT_THAT(text, HasSubstr("node 4 now has z = 0.5"));
}

TEST(XdmfFile, WrittenToAnotherFolderFindsItsOtherFiles) {
  const Scratch scratch;
  std::string text = bytes_of(fixture("mixed_meshio.xdmf"));
  const std::string geometry = "mixed_meshio.h5:/data0";
  text.replace(text.find(geometry), geometry.size(), "points.h5:/data0");
  put_bytes(scratch.path("a.xdmf"), text);
  for (const char* name : {"points.h5", "mixed_meshio.h5"}) {
    put_bytes(scratch.path(name), bytes_of(fixture("mixed_meshio.h5")));
  }
  std::filesystem::create_directory(scratch.path("sub"));
  MeshFile file = read_mesh_file(scratch.path("a.xdmf"));
  test::move_nodes(file.mesh);

  write_mesh_file(scratch.path("sub/b.xdmf"), file);

  EXPECT_TRUE(read_mesh_file(scratch.path("sub/b.xdmf")).mesh.positions == file.mesh.positions);
  EXPECT_THAT(bytes_of(scratch.path("sub/b.xdmf")), HasSubstr(">../mixed_meshio.h5:/data1<"));
  EXPECT_TRUE(std::filesystem::exists(scratch.path("sub/b.h5")));
}

// The library would read 3.7 GB of a file that ends before.
TEST(Exodus, RefusesNamesThatAreLongerThanTheFile) {
  const Scratch scratch;
  std::string bytes = bytes_of(fixture("assembly.exo"));
  const std::size_t place = bytes.find("num_nodes");
  ASSERT_NE(place, std::string::npos);
  bytes.replace(place - 4, 4, "\xdc\xdc\xdc\xdc");
  put_bytes(scratch.path("a.exo"), bytes);
  const auto [reason, text] = test::error_of([&] { (void)read_mesh_file(scratch.path("a.exo")); });
  EXPECT_EQ(reason, "FILE_TRUNCATED");
  EXPECT_THAT(text, ::testing::HasSubstr("3705461980 values, which are more than the file holds"));
}

TEST(Hdf5Formats, RefuseOneAnother) {
  const Scratch scratch;
  put_bytes(scratch.path("a.cgns"), bytes_of(fixture("assembly.med")));
  put_bytes(scratch.path("a.med"), bytes_of(fixture("assembly.cgns")));
  put_bytes(scratch.path("a.exo"), bytes_of(fixture("assembly.cgns")));
  for (const char* name : {"a.cgns", "a.med", "a.exo"}) {
    EXPECT_EQ(error_of([&] { (void)read_mesh_file(scratch.path(name)); }).first, "FORMAT_ERROR");
  }
}

}  // namespace
}  // namespace meshsmooth::formats
