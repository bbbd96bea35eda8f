// Elements of second order in Abaqus decks and TetGen's files; formats that have none.

#include <gmock/gmock.h>

#include <sstream>

#include "node_sets.hpp"
#include "scratch.hpp"
#include "second_order.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::check_cells;
using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct DeckElement {
  const char* type;
  const char* kind;
  std::vector<Vec3d> corners;  // in Abaqus' order
  const char* parts;           // with a node in the middle, by corners from 1, as the manual has it
};

const std::vector<Vec3d> kTriangle = {{0, 0, 0}, {1, 0.1, 0}, {0, 1.1, 0}};
const std::vector<Vec3d> kQuad = {{0, 0, 0}, {1, 0.1, 0}, {1.2, 1.3, 0}, {0, 1.1, 0}};
const std::vector<Vec3d> kTetrahedron = {{0, 0, 0}, {1, 0.1, 0}, {0, 1.1, 0}, {0.2, 0, 1.3}};
const std::vector<Vec3d> kWedge = {{0, 0, 0},     {1, 0.1, 0},   {0, 1.1, 0},
                                   {0.2, 0, 1.3}, {1.1, 0, 1.4}, {0.1, 1.4, 1}};
const std::vector<Vec3d> kHexahedron = {{0, 0, 0},   {1, 0.1, 0},   {1.2, 1.3, 0},   {0, 1.1, 0},
                                        {0, 0, 1.2}, {1, 0.1, 1.1}, {1.2, 1.3, 1.4}, {0, 1.1, 1}};

std::vector<DeckElement> deck_elements() {
  const char* const triangle = "12 23 31";
  const char* const quad = "12 23 34 41";
  const char* const tetrahedron = "12 23 31 14 24 34";
  const char* const wedge = "12 23 31 45 56 64 14 25 36";
  const char* const hexahedron = "12 23 34 41 56 67 78 85 15 26 37 48";
  std::vector<DeckElement> elements;
  for (const char* type : {"CPS6", "CPE6M", "CAX6", "DC2D6", "S6", "STRI65", "M3D6"}) {
    elements.push_back({type, "triangle6", kTriangle, triangle});
  }
  for (const char* type : {"CPS8", "CPE8RH", "CPEG8", "S8R", "S8R5", "M3D8R", "DCAX8"}) {
    elements.push_back({type, "quad8", kQuad, quad});
  }
  for (const char* type : {"S9R5", "M3D9"}) {
    elements.push_back({type, "quad9", kQuad, "12 23 34 41 1234"});
  }
  for (const char* type : {"C3D10", "C3D10M", "C3D10HS", "AC3D10", "DC3D10"}) {
    elements.push_back({type, "tetrahedron10", kTetrahedron, tetrahedron});
  }
  for (const char* type : {"C3D15", "C3D15H", "DC3D15"}) {
    elements.push_back({type, "wedge15", kWedge, wedge});
  }
  for (const char* type : {"C3D20", "C3D20R", "C3D20RH", "AC3D20", "DC3D20"}) {
    elements.push_back({type, "hexahedron20", kHexahedron, hexahedron});
  }
  return elements;
}

/// All nodes of an element, in Abaqus' order.
std::vector<Vec3d> nodes_of(const DeckElement& element) {
  std::vector<Vec3d> nodes = element.corners;
  std::istringstream parts(element.parts);
  for (std::string part; parts >> part;) {
    Vec3d sum{0, 0, 0};
    for (const char corner : part) sum += element.corners[static_cast<std::size_t>(corner - '1')];
    nodes.push_back((1.0 / static_cast<double>(part.size())) * sum);
  }
  return nodes;
}

/// Labels start at 100; a data line has at most `columns` numbers.
std::string deck_of(const DeckElement& element, std::size_t columns) {
  std::ostringstream text;
  text.precision(17);
  text << "*NODE, NSET=all\n";
  std::size_t label = 100;
  for (const Vec3d& node : nodes_of(element)) {
    text << label++ << ", " << node.x << ", " << node.y << ", " << node.z << "\n";
  }
  text << "*ELEMENT, TYPE=" << element.type << ", ELSET=body\n7";
  std::size_t column = 1;
  for (std::size_t node = 100; node < label; ++node) {
    text << (column++ % columns == 0 ? ",\n" : ", ") << node;
  }
  text << "\n*NSET, NSET=last\n" << label - 1 << "\n** the end\n";
  return text.str();
}

class DeckTypes : public ::testing::TestWithParam<DeckElement> {};
INSTANTIATE_TEST_SUITE_P(SecondOrder, DeckTypes, ::testing::ValuesIn(deck_elements()),
                         [](const auto& param) { return std::string(param.param.type); });

TEST_P(DeckTypes, AreReadInTheOrderOfVtk) {
  const Scratch scratch;
  for (const std::size_t columns : {3u, 8u, 16u, 99u}) {
    put_bytes(scratch.path("a.inp"), deck_of(GetParam(), columns));

    const MeshFile file = read_mesh_file(scratch.path("a.inp"));

    const std::map<std::string, int> one = {{GetParam().kind, 1}};
    EXPECT_EQ(check_cells(file), one);
    EXPECT_EQ(file.file_element_id(0), 7);
    EXPECT_EQ(find_node_set(file, "body").size(), nodes_of(GetParam()).size());
    EXPECT_THAT(find_node_set(file, "last"),
                ElementsAre(static_cast<NodeId>(file.mesh.node_count()) - 1));
  }
}

TEST_P(DeckTypes, AreWrittenBackWithOtherCoordinatesOnly) {
  const Scratch scratch;
  put_bytes(scratch.path("a.inp"), deck_of(GetParam(), 16));
  const MeshFile before = read_mesh_file(scratch.path("a.inp"));
  MeshFile moved = before;
  std::get<std::vector<Vec3d>>(moved.mesh.positions).back().x = 0.625;

  write_mesh_file(scratch.path("b.inp"), moved);
  const MeshFile after = read_mesh_file(scratch.path("b.inp"));
  EXPECT_TRUE(after.mesh.positions == moved.mesh.positions);
  test::expect_same_connectivity(after.mesh, before.mesh);

  moved.mesh.positions = before.mesh.positions;
  write_mesh_file(scratch.path("b.inp"), moved);
  EXPECT_EQ(bytes_of(scratch.path("b.inp")), bytes_of(scratch.path("a.inp")));
}

constexpr const char* kLines =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0.5, 0, 0\n5, 0.5, 0.5, 0\n6, 0, 0.5, 0\n"
    "*ELEMENT, TYPE=S6\n1, 1, 2, 3, 4, 5, 6\n";

// Of lines the middle node is the second.
TEST(SecondOrderDeck, HasLinesWithThreeNodes) {
  const Scratch scratch;
  put_bytes(scratch.path("a.inp"), std::string(kLines) +
                                       "*ELEMENT, TYPE=B32, ELSET=rim\n2, 1, 4, 2\n"
                                       "*ELEMENT, TYPE=T3D3\n3, 2, 5, 3\n");

  const MeshFile file = read_mesh_file(scratch.path("a.inp"));

  const std::map<std::string, int> expected = {{"edge3", 2}, {"triangle6", 1}};
  EXPECT_EQ(check_cells(file), expected);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_THAT(find_node_set(file, "rim"), ElementsAre(0, 1, 3));
}

TEST(SecondOrderDeck, HoldsTypesOfWhichTheNodesVary) {
  const Scratch scratch;
  for (const char* type : {"C3D15V", "C3D15VH", "C3D27", "C3D27R", "C3D13", "C3D14", "C3D11"}) {
    put_bytes(scratch.path("a.inp"),
              std::string(kLines) + "*ELEMENT, TYPE=" + type + "\n9, 1, 2, 3, 4, 5, 6\n");
    const MeshFile file = read_mesh_file(scratch.path("a.inp"));
    ASSERT_EQ(file.held_cells().size(), 1U) << type;
    EXPECT_EQ(file.held_cells()[0].name, type);
    EXPECT_EQ(file.held_cells()[0].count, 1);
  }
}

TEST(SecondOrderDeck, RefusesTooFewNodes) {
  const Scratch scratch;
  const auto error_with = [&](const std::string& more) {
    put_bytes(scratch.path("a.inp"), kLines + more);
    return error_of([&] { (void)read_mesh_file(scratch.path("a.inp")); });
  };
  EXPECT_THAT(error_with("2, 1, 2, 3, 4, 5\n*NSET, NSET=a\n").second,
              HasSubstr("element 2 has 5 of its 6 nodes"));
  EXPECT_EQ(error_with("2, 1, 2, 3, 4,\n").first, "FILE_TRUNCATED");
}

// Of both orders: `validate` names the two types.
TEST(SecondOrderDeck, MayHaveElementsOfBothOrders) {
  const Scratch scratch;
  put_bytes(scratch.path("a.inp"), std::string(kLines) + "*ELEMENT, TYPE=S3\n2, 1, 2, 3\n");
  const MeshFile file = read_mesh_file(scratch.path("a.inp"));

  const auto [reason, text] = error_of([&] { validate(MeshTopology(file.mesh).view()); });

  EXPECT_EQ(reason, "MIXED_ORDERS");
  EXPECT_THAT(text, HasSubstr("block 1 (triangle) and block 0 (triangle6)"));
}

// --- TetGen -------------------------------------------------------------------------

TEST(SecondOrderTetGen, HasTheNodesThatTetGenAdded) {
  const MeshFile file = read_mesh_file(fixture("second_order.ele"));
  const std::map<std::string, int> expected = {{"tetrahedron10", 13}};
  EXPECT_EQ(check_cells(file), expected);
}

TEST(SecondOrderTetGen, IsWrittenBackAndAnew) {
  const Scratch scratch;
  MeshFile file = read_mesh_file(fixture("second_order.node"));
  write_mesh_file(scratch.path("a.node"), file);
  for (const char* extension : {".node", ".ele"}) {
    EXPECT_EQ(bytes_of(scratch.path("a").replace_extension(extension)),
              bytes_of(fixture(std::string("second_order") + extension)));
  }

  write_mesh_file(scratch.path("b.ele"), MeshFile(file.mesh));
  const MeshFile anew = read_mesh_file(scratch.path("b.ele"));
  EXPECT_EQ(check_cells(anew), check_cells(file));
  EXPECT_TRUE(anew.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(anew.mesh, file.mesh);
  EXPECT_THAT(bytes_of(scratch.path("b.ele")), HasSubstr("13 10 0\n"));
}

TEST(SecondOrderTetGen, RefusesAnotherNumberOfNodes) {
  const Scratch scratch;
  put_bytes(scratch.path("a.node"), bytes_of(fixture("second_order.node")));
  std::string text = bytes_of(fixture("second_order.ele"));
  const auto ten = text.find("10");
  text.replace(ten, 2, "11");
  put_bytes(scratch.path("a.ele"), text);
  const auto [reason, what] = error_of([&] { (void)read_mesh_file(scratch.path("a.ele")); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(what, HasSubstr("its elements have 11 nodes; only tetrahedra with 4 or 10 nodes"));

  Mesh mesh = test::crooked_element(ElementType::tetrahedron10);
  mesh.blocks.push_back({ElementType::tetrahedron, {0, 1, 2, 3}});
  EXPECT_EQ(error_of([&] { write_mesh_file(scratch.path("b.ele"), MeshFile(mesh)); }).first,
            "ELEMENT_NOT_SUPPORTED");
}

// --- formats that have none ---------------------------------------------------------

TEST(SecondOrderSu2, IsRefusedByName) {
  const Scratch scratch;
  for (const int type : {21, 22, 23, 24, 28}) {
    put_bytes(scratch.path("a.su2"),
              "NDIME= 2\nNELEM= 1\n" + std::to_string(type) + " 0 1 2 3 4 5 6 7 8 9\n");
    const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.su2")); });
    EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
    EXPECT_THAT(text, HasSubstr("VTK cell type " + std::to_string(type) + "; only linear"));
  }
}

}  // namespace
}  // namespace meshsmooth::formats
