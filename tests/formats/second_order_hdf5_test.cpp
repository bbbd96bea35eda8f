// Elements of second order in MED, CGNS, Exodus and XDMF files (files/make_second_order_files.py).

#include <gmock/gmock.h>

#include <sstream>

#include "exodus/sides.hpp"
#include "node_sets.hpp"
#include "scratch.hpp"
#include "second_order.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::check_cells;
using test::crooked_element;
using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

const std::map<std::string, int>& one_of_each() {
  static const std::map<std::string, int> counts = {
      {"edge3", 1},   {"triangle6", 1}, {"quad8", 1},     {"quad9", 1},        {"tetrahedron10", 1},
      {"wedge15", 1}, {"wedge18", 1},   {"pyramid13", 1}, {"hexahedron20", 1}, {"hexahedron27", 1}};
  return counts;
}

class SecondOrderFile : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Hdf5Formats, SecondOrderFile,
                         ::testing::Values("second_order.med", "second_order.cgns",
                                           "second_order.exo", "second_order.xdmf"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST_P(SecondOrderFile, HasEveryTypeInTheOrderOfVtk) {
  const MeshFile file = read_mesh_file(fixture(GetParam()));
  EXPECT_EQ(check_cells(file), one_of_each());
  EXPECT_EQ(file.mesh.element_count(), 6u);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 4);
  EXPECT_EQ(file.lower_dimensional_nodes().size(), 3u + 6 + 8 + 9);
}

TEST_P(SecondOrderFile, IsWrittenBackWithOtherPositionsOnly) {
  const Scratch scratch;
  const MeshFile before = read_mesh_file(fixture(GetParam()));
  const auto path = scratch.path(std::string("a") + fixture(GetParam()).extension().string());
  write_mesh_file(path, before);
  EXPECT_EQ(bytes_of(path), bytes_of(fixture(GetParam())));

  MeshFile moved = before;
  test::move_nodes(moved.mesh);
  write_mesh_file(path, moved);
  const MeshFile after = read_mesh_file(path);
  EXPECT_TRUE(after.mesh.positions == moved.mesh.positions);
  test::expect_same_connectivity(after.mesh, before.mesh);
  EXPECT_EQ(after.lower_dimensional_nodes(), before.lower_dimensional_nodes());
}

// A program that sees all cells the other way round, with their middle nodes.
TEST_P(SecondOrderFile, MayBeMirrored) {
  const Scratch scratch;
  MeshFile file = read_mesh_file(fixture(GetParam()));
  for (Vec3d& node : std::get<std::vector<Vec3d>>(file.mesh.positions)) node.y = -node.y;
  const auto path = scratch.path(std::string("a") + fixture(GetParam()).extension().string());

  write_mesh_file(path, file);

  EXPECT_EQ(check_cells(read_mesh_file(path)), one_of_each());
}

#if defined(MESHSMOOTH_WITH_VTK) && defined(MESHSMOOTH_WITH_GMSH)
TEST_P(SecondOrderFile, BecomesOtherFormats) {
  const Scratch scratch;
  const MeshFile file = read_mesh_file(fixture(GetParam()));
  write_mesh_file(scratch.path("a.vtu"), file);
  write_mesh_file(scratch.path("b.msh"), read_mesh_file(scratch.path("a.vtu")));
  const MeshFile after = read_mesh_file(scratch.path("b.msh"));
  EXPECT_EQ(check_cells(after), one_of_each());
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
}
#endif

TEST(SecondOrderMed, HasGroupsWithNodesInTheMiddle) {
  const MeshFile file = read_mesh_file(fixture("second_order.med"));
  EXPECT_EQ(find_node_set(file, "skin").size(), 6u + 8 + 9);
}

TEST(SecondOrderCgns, HasConditionsWithNodesInTheMiddle) {
  const MeshFile file = read_mesh_file(fixture("second_order.cgns"));
  EXPECT_EQ(find_node_set(file, "skin").size(), 6u + 8 + 9);
}

TEST(SecondOrderCgns, RefusesThePyramidWith14Nodes) {
  const Scratch scratch;
  std::string bytes = bytes_of(fixture("second_order.cgns"));
  const std::string pyramid13("\x15\0\0\0\0\0\0\0", 8);  // PYRA_13, and no parent
  const auto at = bytes.find(pyramid13);
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 13;
  put_bytes(scratch.path("a.cgns"), bytes);
  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.cgns")); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("elements of the type PYRA_14; only linear"));
}

TEST(SecondOrderExodus, HasSidesWithNodesInTheMiddle) {
  const MeshFile file = read_mesh_file(fixture("second_order.exo"));
  // tetrahedron10, pyramid13: triangles; wedges, hexahedra: quads, two with a node in the middle.
  EXPECT_EQ(find_node_set(file, "sideset_1").size(), 6u + 6 + 8 + 9 + 8 + 9);
  EXPECT_EQ(find_node_set(file, "block_10").size(), 27u);
}

TEST(SecondOrderExodus, HasTheSidesOfTheManual) {
  const auto side = [](const char* type, std::size_t width, std::int64_t number) {
    return find_exodus_side(find_exodus_shape(type, width, 2).value(), number).nodes;
  };
  EXPECT_THAT(side("TETRA", 10, 2), UnorderedElementsAre(1, 2, 3, 5, 9, 8));
  EXPECT_THAT(side("HEX", 20, 5), UnorderedElementsAre(0, 3, 2, 1, 11, 10, 9, 8));
  EXPECT_THAT(side("HEX", 20, 6), UnorderedElementsAre(4, 5, 6, 7, 16, 17, 18, 19));
  EXPECT_THAT(side("HEX", 27, 4), UnorderedElementsAre(0, 4, 7, 3, 12, 19, 15, 11, 23));
  EXPECT_THAT(side("WEDGE", 15, 3), UnorderedElementsAre(0, 3, 5, 2, 9, 14, 11, 8));
  EXPECT_THAT(side("WEDGE", 15, 5), UnorderedElementsAre(3, 4, 5, 12, 13, 14));
  EXPECT_THAT(side("WEDGE", 18, 2), UnorderedElementsAre(1, 2, 5, 4, 7, 11, 13, 10, 16));
  EXPECT_THAT(side("PYRAMID", 13, 5), UnorderedElementsAre(0, 3, 2, 1, 8, 7, 6, 5));
  EXPECT_THAT(side("SHELL", 9, 1), UnorderedElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(side("SHELL8", 8, 3), UnorderedElementsAre(0, 1, 4));
  EXPECT_THAT(side("TRI6", 6, 3), UnorderedElementsAre(2, 0, 5));
  EXPECT_TRUE(side("TETRA", 10, 5).empty());
}

TEST(SecondOrderExodus, RefusesOtherNumbersOfNodes) {
  for (const auto& [type, width] : {std::pair<const char*, std::size_t>{"TETRA", 8},
                                    {"TETRA", 11},
                                    {"TETRA", 14},
                                    {"TETRA", 15},
                                    {"PYRAMID", 14},
                                    {"WEDGE", 16},
                                    {"WEDGE", 21},
                                    {"HEX", 21},
                                    {"TRI", 7},
                                    {"QUAD", 5},
                                    {"BAR", 4}}) {
    EXPECT_FALSE(find_exodus_shape(type, width, 2).has_value()) << type << width;
  }
}

// --- XDMF: by its names -------------------------------------------------------------

std::string xdmf_of(const std::string& type, const Mesh& mesh) {
  std::ostringstream text;
  text.precision(17);
  text << "<Xdmf><Domain><Grid Name=\"g\"><Topology TopologyType=\"" << type
       << "\" NumberOfElements=\"1\"><DataItem DataType=\"Int\">";
  for (const NodeId node : mesh.blocks.front().nodes) text << node << ' ';
  text << "</DataItem></Topology><Geometry GeometryType=\"XYZ\"><DataItem>";
  for (const Vec3d& node : meshsmooth::test::points(mesh)) {
    text << node.x << ' ' << node.y << ' ' << node.z << '\n';
  }
  text << "</DataItem></Geometry></Grid></Domain></Xdmf>";
  return text.str();
}

TEST(SecondOrderXdmf, KnowsTheTypesByTheirNames) {
  const Scratch scratch;
  const std::vector<std::pair<std::string, ElementType>> names = {
      {"Triangle_6", ElementType::triangle6},       {"Tri_6", ElementType::triangle6},
      {"Quadrilateral_8", ElementType::quad8},      {"QUAD_8", ElementType::quad8},
      {"Quadrilateral_9", ElementType::quad9},      {"Tetrahedron_10", ElementType::tetrahedron10},
      {"Tet_10", ElementType::tetrahedron10},       {"Pyramid_13", ElementType::pyramid13},
      {"Wedge_15", ElementType::wedge15},           {"Wedge_18", ElementType::wedge18},
      {"Hexahedron_20", ElementType::hexahedron20}, {"Hex_27", ElementType::hexahedron27}};
  for (const auto& [name, type] : names) {
    const Mesh mesh = crooked_element(type);
    put_bytes(scratch.path("a.xdmf"), xdmf_of(name, mesh));
    const MeshFile file = read_mesh_file(scratch.path("a.xdmf"));
    test::expect_same_connectivity(file.mesh, mesh);
    EXPECT_EQ(check_cells(file).size(), 1u);
  }
}

// As dolfinx writes tags of facets.
TEST(SecondOrderXdmf, HasTagsOfFacets) {
  const Scratch scratch;
  std::string text = xdmf_of("Tetrahedron_10", crooked_element(ElementType::tetrahedron10));
  const std::string tags =
      "<Grid Name=\"walls\"><Topology TopologyType=\"Triangle_6\"><DataItem DataType=\"Int\">"
      "0 1 2 4 5 6  1 2 3 5 9 8</DataItem></Topology><Attribute Name=\"walls\" Center=\"Cell\">"
      "<DataItem DataType=\"Int\">3 4</DataItem></Attribute></Grid>";
  text.insert(text.find("</Domain>"), tags);
  put_bytes(scratch.path("a.xdmf"), text);

  const MeshFile file = read_mesh_file(scratch.path("a.xdmf"));

  EXPECT_EQ(find_node_set(file, "walls:3"), (std::vector<NodeId>{0, 1, 2, 4, 5, 6}));
  EXPECT_EQ(find_node_set(file, "walls:4"), (std::vector<NodeId>{1, 2, 3, 5, 8, 9}));
}

TEST(SecondOrderXdmf, RefusesOtherTypes) {
  const Scratch scratch;
  for (const char* name : {"Hexahedron_24", "Hexahedron_64", "Tetrahedron_20", "Pyramid_14"}) {
    put_bytes(scratch.path("a.xdmf"), xdmf_of(name, crooked_element(ElementType::hexahedron20)));
    const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.xdmf")); });
    EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED") << name;
    EXPECT_THAT(text, HasSubstr(name));
  }
}

TEST(SecondOrderXdmf, RefusesAMixedTopologyWithOtherTypes) {
  const Scratch scratch;
  std::string text = bytes_of(fixture("second_order.xdmf"));
  const auto at = text.find("\n50 ");  // Hexahedron_27
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 4, "\n49 ");
  put_bytes(scratch.path("a.xdmf"), text);
  const auto [reason, what] = error_of([&] { (void)read_mesh_file(scratch.path("a.xdmf")); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(what, HasSubstr("elements of the type number 49"));
}

}  // namespace
}  // namespace meshsmooth::formats
