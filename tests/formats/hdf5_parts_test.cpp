// MED, CGNS, Exodus and XDMF: meshes in parts (zones, grids, time steps) and cells that keep their
// nodes, by the files of files/make_parts_files.py.

#include <gmock/gmock.h>

#include "mesh_file.hpp"
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
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::vector<Vec3d> positions_of(const MeshFile& file) {
  std::vector<Vec3d> all;
  std::visit(
      [&](const auto& nodes) {
        for (const auto& node : nodes) all.push_back(vec3_cast<double>(node));
      },
      file.mesh.positions);
  return all;
}

std::vector<NodeId> fixed_nodes(const MeshFile& file) {
  std::vector<NodeId> nodes;
  for (std::size_t node = 0; node < file.mesh.fixed.size(); ++node) {
    if (file.mesh.fixed[node] != 0) nodes.push_back(static_cast<NodeId>(node));
  }
  return nodes;
}

/// "2 polyhedron, 1 SUPER".
std::string held(const MeshFile& file) {
  std::string text;
  for (const HeldCells& cells : file.held_cells()) {
    text += (text.empty() ? "" : ", ") + std::to_string(cells.count) + " " + cells.name;
  }
  return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class CgnsZones : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Containers, CgnsZones, ::testing::Values("zones.cgns", "zones_adf.cgns"),
                         [](const auto& param) {
                           return std::string(param.index == 0 ? "Hdf5" : "Adf");
                         });

TEST_P(CgnsZones, AreOneMeshWithTheNodesOfTheirInterfaceInPairs) {
  const MeshFile file = read_mesh_file(fixture(GetParam()));

  EXPECT_EQ(file.mesh.node_count(), 32U);
  EXPECT_EQ(file.mesh.element_count(), 6U);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  const std::vector<NodeId> interface = {3, 7, 11, 15, 16, 20, 24, 28};
  EXPECT_THAT(fixed_nodes(file), ::testing::IsEmpty());
  EXPECT_EQ(file.node_pairs(),
            (std::vector<NodePair>{
                {3, 16}, {7, 20}, {11, 24}, {15, 28}, {16, 3}, {20, 7}, {24, 11}, {28, 15}}));
  EXPECT_EQ(find_node_set(file, "to_right"), interface);
  EXPECT_EQ(find_node_set(file, "end"), interface);
  EXPECT_EQ(find_node_set(file, "right").front(), 16);
  EXPECT_EQ(find_node_set(file, "bricks").size(), 32U);
  EXPECT_EQ(find_regions(file, "cgns:zone").count, 2U);
  EXPECT_EQ(file.file_element_id(3), 5) << "four elements are in the zone before";
  EXPECT_EQ(positions_of(file)[16].x, 3);
}

TEST(CgnsFile, IsTheSameInBothContainers) {
  const MeshFile hdf5 = read_mesh_file(fixture("zones.cgns"));
  const MeshFile adf = read_mesh_file(fixture("zones_adf.cgns"));
  EXPECT_TRUE(hdf5.mesh.positions == adf.mesh.positions);
  test::expect_same_connectivity(hdf5.mesh, adf.mesh);
}

TEST(CgnsFile, InAdfChangesInTheBytesOfItsCoordinatesOnly) {
  for (const char* name : {"zones_adf.cgns", "polyhedra_adf.cgns"}) {
    const Scratch scratch;
    MeshFile file = read_mesh_file(fixture(name));
    std::visit([](auto& nodes) { nodes[5].y += 0.25F; }, file.mesh.positions);

    write_mesh_file(scratch.path("out.cgns"), file);

    const std::string before = bytes_of(fixture(name));
    const std::string after = bytes_of(scratch.path("out.cgns"));
    ASSERT_EQ(before.size(), after.size());
    std::size_t changed = 0;
    for (std::size_t at = 0; at < before.size(); ++at) changed += before[at] != after[at] ? 1 : 0;
    EXPECT_GT(changed, 0U);
    EXPECT_LE(changed, sizeof(double));
    EXPECT_TRUE(read_mesh_file(scratch.path("out.cgns")).mesh.positions == file.mesh.positions);
  }
}

TEST(CgnsFile, InAdfIsRefusedWhereItIsDamaged) {
  const Scratch scratch;
  const std::string bytes = bytes_of(fixture("zones_adf.cgns"));
  put_bytes(scratch.path("a.cgns"), replaced(bytes, "Unstructured", "Structured  "));
  const auto structured = error_of([&] { (void)read_mesh_file(scratch.path("a.cgns")); });
  EXPECT_EQ(structured.first, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(structured.second, HasSubstr("is structured"));
  put_bytes(scratch.path("a.cgns"), replaced(bytes, "AdF2L", "AdF2C"));
  EXPECT_THAT(error_of([&] { (void)read_mesh_file(scratch.path("a.cgns")); }).second,
              HasSubstr("convert it with cgnsconvert or adf2hdf"));
  put_bytes(scratch.path("a.cgns"), bytes.substr(0, 5000));
  EXPECT_EQ(error_of([&] { (void)read_mesh_file(scratch.path("a.cgns")); }).first,
            "FILE_TRUNCATED");
}

TEST(CgnsFile, RecognizesHexahedraByTheirFacesAndHoldsPolyhedra) {
  for (const char* name : {"polyhedra.cgns", "polyhedra_adf.cgns"}) {
    const MeshFile file = read_mesh_file(fixture(name));

    EXPECT_EQ(file.mesh.node_count(), 17U);
    ASSERT_THAT(file.mesh.blocks, SizeIs(1));
    EXPECT_EQ(file.mesh.blocks[0].type, ElementType::hexahedron);
    EXPECT_EQ(file.mesh.element_count(), 2U);
    EXPECT_EQ(held(file), "1 polyhedron");
    EXPECT_THAT(fixed_nodes(file), ElementsAre(2, 3, 6, 7, 10, 11, 14, 15, 16));
    EXPECT_THAT(find_node_set(file, "tip"), ElementsAre(3, 7, 11, 15, 16));
    EXPECT_EQ(positions_of(file)[16].y, 0.5);
  }
}

TEST(ExodusFile, HasTheSidesOfShellsWhereQuadsAndTrianglesAreInSpace) {
  const MeshFile file = read_mesh_file(fixture("shells.exo"));

  EXPECT_EQ(file.mesh.element_count(), 10U);
  EXPECT_THAT(find_node_set(file, "sideset_1"), ElementsAre(0, 4, 8));
  EXPECT_THAT(find_node_set(file, "sideset_2"), ElementsAre(0, 1, 4, 5));
  EXPECT_THAT(find_node_set(file, "sideset_3"), ElementsAre(10, 11, 14));
  EXPECT_THAT(find_node_set(file, "sideset_4"), ElementsAre(0, 15));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 3) << "two beams and a point";
  EXPECT_EQ(held(file), "1 SUPER");
  EXPECT_THAT(fixed_nodes(file), ElementsAre(5, 6, 9));
  EXPECT_THAT(find_node_set(file, "block_15"), ElementsAre(5, 6, 9));
}

TEST(ExodusFile, HoldsPolyhedraAndPolygons) {
  const MeshFile file = read_mesh_file(fixture("polyhedra.exo"));

  EXPECT_EQ(file.mesh.element_count(), 2U);
  EXPECT_EQ(held(file), "1 polyhedron");
  EXPECT_THAT(fixed_nodes(file), ElementsAre(2, 3, 6, 7, 10, 11, 14, 15));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_THAT(find_node_set(file, "sideset_1"), ElementsAre(0, 1, 3, 7, 15));
}

TEST(ExodusFile, IsRefusedWhereABlockIsNotAsLongAsTheFileSays) {
  const Scratch scratch;
  const auto refused = [&](const std::string& from, const std::string& to) {
    put_bytes(scratch.path("a.exo"), replaced(bytes_of(fixture("shells.exo")), from, to));
    return error_of([&] { (void)read_mesh_file(scratch.path("a.exo")); });
  };
  EXPECT_THAT(refused("connect2", "konnect2").second,
              HasSubstr("block 11 has 2 elements but no variable \"connect2\""));
  const std::string one(3, '\0');
  EXPECT_THAT(
      refused(std::string("num_elem") + one + "\x0e", std::string("num_elem") + one + "\x0f")
          .second,
      HasSubstr("its blocks have 14 elements, by \"num_elem\" 15"));
  const auto [reason, text] = refused("beam2", "tetra");
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("block 12 has elements of the type \"tetra\" with 2 nodes"));
}

TEST(MedFile, HoldsPolyhedraAndTakesTheMeshWithElements) {
  const MeshFile file = read_mesh_file(fixture("polyhedra.med"));

  EXPECT_EQ(file.mesh.node_count(), 16U);
  EXPECT_EQ(file.mesh.element_count(), 2U);
  EXPECT_EQ(held(file), "1 polyhedron");
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_THAT(find_node_set(file, "odd"), ElementsAre(2, 3, 6, 7, 10, 11, 14, 15));
}

TEST(XdmfFile, ChangesAllCopiesThatATimeSeriesHasOfItsMesh) {
  const Scratch scratch;
  put_bytes(scratch.path("checkpoint.h5"), bytes_of(fixture("checkpoint.h5")));
  put_bytes(scratch.path("checkpoint.xdmf"), bytes_of(fixture("checkpoint.xdmf")));
  MeshFile file = read_mesh_file(scratch.path("checkpoint.xdmf"));
  EXPECT_EQ(file.mesh.node_count(), 9U);
  EXPECT_EQ(file.mesh.element_count(), 8U);
  std::get<std::vector<Vec3d>>(file.mesh.positions)[4] = {1, 1, 0};

  write_mesh_file(scratch.path("checkpoint.xdmf"), file);

  const std::string text = bytes_of(scratch.path("checkpoint.xdmf"));
  EXPECT_EQ(text, bytes_of(fixture("checkpoint.xdmf")));
  // By the second step alone.
  const std::size_t first = text.find("      <Grid"), second = text.find("      <Grid", first + 1);
  put_bytes(scratch.path("second.xdmf"), text.substr(0, first) + text.substr(second));
  EXPECT_TRUE(read_mesh_file(scratch.path("second.xdmf")).mesh.positions == file.mesh.positions);
}

}  // namespace
}  // namespace meshsmooth::formats
