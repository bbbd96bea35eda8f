// Elements of second order in VTK's and Gmsh's formats, and from one format to another.

#include <gmock/gmock.h>
#include <vtkCell.h>
#include <vtkGenericCell.h>
#include <vtkIdList.h>
#include <vtkNew.h>

#include <set>

#include "cell_sides.hpp"
#include "meshsmooth/quality.hpp"
#include "node_sets.hpp"
#include "scratch.hpp"
#include "second_order.hpp"

namespace meshsmooth::formats {
namespace {

using meshsmooth::test::second_order;
using test::check_cells;
using test::crooked_element;
using test::error_of;
using test::fixture;
using test::Scratch;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

std::vector<ElementType> second_order_types() {
  std::vector<ElementType> types;
  for (const ElementType type : kElementTypes) {
    if (is_second_order(type)) types.push_back(type);
  }
  return types;
}

/// Corners by the node in their middle, of what VTK calls an edge or a face of a cell: as many
/// corners as half its nodes, but of a face with a node in the middle also that one.
void add_middle(vtkCell& part, std::map<std::set<int>, int>& middles) {
  const auto id = [&](int place) { return static_cast<int>(part.GetPointIds()->GetId(place)); };
  const vtkIdType count = part.GetNumberOfPoints();
  if (count == 3) middles[{id(0), id(1)}] = id(2);
  if (count == 9) middles[{id(0), id(1), id(2), id(3)}] = id(8);
}

class EveryType : public ::testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(SecondOrder, EveryType, ::testing::ValuesIn(second_order_types()),
                         [](const auto& param) { return std::string(element_name(param.param)); });

TEST_P(EveryType, HasTheNodeOrderOfVtk) {
  const vtkNew<vtkGenericCell> cell;
  cell->SetCellType(cell_kind(GetParam()).vtk_type);
  ASSERT_EQ(cell->GetNumberOfPoints(), static_cast<vtkIdType>(element_width(GetParam())));
  for (vtkIdType node = 0; node < cell->GetNumberOfPoints(); ++node) {
    cell->GetPointIds()->SetId(node, node);
  }
  std::map<std::set<int>, int> middles;
  for (int edge = 0; edge < cell->GetNumberOfEdges(); ++edge) {
    add_middle(*cell->GetEdge(edge), middles);
  }
  for (int face = 0; face < cell->GetNumberOfFaces(); ++face) {
    add_middle(*cell->GetFace(face), middles);
  }

  int node = static_cast<int>(element_width(linear_type(GetParam())));
  for (const MidNode& mid : mid_nodes(GetParam())) {
    const auto corners = std::span(mid.corners).first(static_cast<std::size_t>(mid.corner_count));
    const auto found = middles.find({corners.begin(), corners.end()});
    if (found != middles.end()) {
      EXPECT_EQ(found->second, node);
    } else {
      EXPECT_EQ(static_cast<std::size_t>(node + 1), element_width(GetParam())) << "the centre";
    }
    ++node;
  }
}

// --- one element through every format that can carry it ---------------------------

struct Carrier {
  std::string extension;
  ElementType type;
};
void PrintTo(const Carrier& carrier, std::ostream* out) {
  *out << carrier.extension << " " << element_name(carrier.type);
}

std::vector<Carrier> carriers(bool able) {
  using enum ElementType;
  const std::vector<ElementType> all = second_order_types();
  std::map<std::string, std::vector<ElementType>> types = {
      {".vtu", all}, {".vtk", all}, {".vtp", {}}, {".stl", {}},
      {".obj", {}},  {".ply", {}},  {".su2", {}}, {".node", {tetrahedron10}}};
  types[".bdf"] =
      types[".nas"] = {triangle6, quad8, quad9, tetrahedron10, pyramid13, wedge15, hexahedron20};
  const std::vector<ElementType> most = {triangle6, quad8, tetrahedron10, wedge15, hexahedron20};
  types[".unv"] = most;
  types[".mesh"] = types[".meshb"] = {triangle6, quad9, tetrahedron10, wedge18, hexahedron27};
#if defined(MESHSMOOTH_WITH_GMSH)
  types[".msh"] = all;
  types[".inp"] = most;
  types[".inp"].push_back(quad9);
#endif
  std::vector<Carrier> cases;
  for (const auto& [extension, carried] : types) {
    for (const ElementType type : all) {
      if ((std::ranges::find(carried, type) != carried.end()) == able) {
        cases.push_back({extension, type});
      }
    }
  }
  return cases;
}

std::string name_of(const Carrier& carrier) {
  return carrier.extension.substr(1) + "_" + std::string(element_name(carrier.type));
}

class Able : public ::testing::TestWithParam<Carrier> {};
INSTANTIATE_TEST_SUITE_P(SecondOrder, Able, ::testing::ValuesIn(carriers(true)),
                         [](const auto& param) { return name_of(param.param); });

TEST_P(Able, KeepsPositionsAndNodeOrder) {
  const Scratch scratch;
  const auto path = scratch.path("a" + GetParam().extension);
  const MeshFile file(crooked_element(GetParam().type));

  write_mesh_file(path, file);

  const MeshFile after = read_mesh_file(path);
  const bool columns = GetParam().extension == ".bdf" || GetParam().extension == ".nas";
  EXPECT_EQ(check_cells(after, columns ? 1e-6 : 1e-12).size(), 1u);
  test::expect_same_connectivity(after.mesh, file.mesh);
  EXPECT_TRUE(columns || after.mesh.positions == file.mesh.positions);
}

TEST(SecondOrderVtk, WedgesAreReadFromEitherSide) {
  for (const ElementType type : {ElementType::wedge15, ElementType::wedge18}) {
    const Scratch scratch;
    const Mesh mesh = crooked_element(type);
    Mesh turned = mesh;
    mirror(cell_kind(type), std::span(turned.blocks[0].nodes));
    ASSERT_NE(turned.blocks[0].nodes, mesh.blocks[0].nodes);
    const auto path = scratch.path("a.vtu");

    write_mesh_file(path, MeshFile(turned));

    const MeshFile after = read_mesh_file(path);
    test::expect_same_connectivity(after.mesh, mesh);
    EXPECT_EQ(measure_quality(after.mesh).inverted_count, 0);
  }
}

// The file that it was read from changes in its coordinates only.
TEST_P(Able, IsWrittenBackToItsOwnFormat) {
  const Scratch scratch;
  const auto path = scratch.path("a" + GetParam().extension);
  write_mesh_file(path, MeshFile(crooked_element(GetParam().type)));
  const MeshFile before = read_mesh_file(path);
  MeshFile moved = before;
  test::move_nodes(moved.mesh);
  const auto to = scratch.path("b" + GetParam().extension);

  write_mesh_file(to, moved);

  const MeshFile after = read_mesh_file(to);
  test::expect_same_connectivity(after.mesh, before.mesh);
  const bool all_digits =
      !std::set<std::string>{".bdf", ".nas", ".inp"}.contains(GetParam().extension);
  EXPECT_TRUE(!all_digits || after.mesh.positions == moved.mesh.positions);
  moved.mesh.positions = before.mesh.positions;
  write_mesh_file(to, moved);
  EXPECT_EQ(test::bytes_of(to), test::bytes_of(path));
}

class Unable : public ::testing::TestWithParam<Carrier> {};
INSTANTIATE_TEST_SUITE_P(SecondOrder, Unable, ::testing::ValuesIn(carriers(false)),
                         [](const auto& param) { return name_of(param.param); });

TEST_P(Unable, SaysThatItCannotCarryTheElement) {
  const Scratch scratch;
  const auto path = scratch.path("a" + GetParam().extension);
  Mesh mesh = crooked_element(GetParam().type);
  for (Vec3d& node : meshsmooth::test::points(mesh)) {  // as .su2 files want it
    if (element_shape(GetParam().type).dimension == 2) node.z = 0;
  }

  const auto [reason, text] = error_of([&] { write_mesh_file(path, MeshFile(mesh)); });

  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("cannot carry a "));
  EXPECT_EQ(scratch.file_count(), 0u);
}

// --- meshes -------------------------------------------------------------------------

class Chains : public ::testing::TestWithParam<std::vector<std::string>> {};
std::vector<std::vector<std::string>> chains() {
  std::vector<std::vector<std::string>> chains = {{".vtu", ".vtk", ".vtu"}};
#if defined(MESHSMOOTH_WITH_GMSH)
  chains.push_back({".vtu", ".msh", ".vtk", ".msh"});
#endif
  return chains;
}
INSTANTIATE_TEST_SUITE_P(SecondOrder, Chains, ::testing::ValuesIn(chains()));

TEST_P(Chains, KeepEveryNodeInItsPlace) {
  for (const bool full : {false, true}) {
    const Scratch scratch;
    const Mesh mesh = second_order(meshsmooth::test::mixed_stack(2), full);
    MeshFile file(mesh);
    int step = 0;
    for (const std::string& extension : GetParam()) {
      const auto path = scratch.path(std::to_string(++step) + extension);
      write_mesh_file(path, file);
      file = read_mesh_file(path);
      EXPECT_EQ(check_cells(file).size(), 4u) << extension;
      EXPECT_TRUE(file.mesh.positions == mesh.positions);
    }
    EXPECT_EQ(file.mesh.element_count(), mesh.element_count());
  }
}

#if defined(MESHSMOOTH_WITH_GMSH)

class ByGmsh : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(SecondOrder, ByGmsh,
                         ::testing::Values("second_order.msh", "second_order_v2.msh"));

TEST_P(ByGmsh, HasEveryTypeInTheOrderOfVtk) {
  const MeshFile file = read_mesh_file(fixture(GetParam()));
  const std::map<std::string, int> one_of_each = {
      {"edge3", 1},   {"triangle6", 1}, {"quad8", 1},     {"quad9", 1},        {"tetrahedron10", 1},
      {"wedge15", 1}, {"wedge18", 1},   {"pyramid13", 1}, {"hexahedron20", 1}, {"hexahedron27", 1}};
  EXPECT_EQ(check_cells(file), one_of_each);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 4);
  EXPECT_EQ(file.lower_dimensional_nodes().size(), 3u + 6 + 8 + 9);
}

// Also a boundary's nodes in the middle belong to its group.
TEST_P(ByGmsh, BecomesVtkAndComesBack) {
  const Scratch scratch;
  const MeshFile file = read_mesh_file(fixture(GetParam()));
  write_mesh_file(scratch.path("a.vtu"), file);
  write_mesh_file(scratch.path("b.msh"), read_mesh_file(scratch.path("a.vtu")));

  const MeshFile after = read_mesh_file(scratch.path("b.msh"));

  EXPECT_EQ(check_cells(after), check_cells(file));
  for (const MeshFile& each : {file, after}) {
    EXPECT_EQ(find_node_set(each, "edges").size(), 3u);
    EXPECT_EQ(find_node_set(each, "skin").size(), 6u + 8 + 9);
    EXPECT_EQ(find_node_set(each, "body").size(), 10u + 13 + 15 + 18 + 20 + 27);
  }
}

TEST(SecondOrderMsh, WithBoundaryBecomesOtherFormats) {
  const Scratch scratch;
  const MeshFile file = read_mesh_file(fixture("quadratic.msh"));
  const auto expected = check_cells(file, 1e-9);
  EXPECT_THAT(expected, IsSupersetOf({std::pair<const std::string, int>{"point", 8}}));
  for (const char* extension : {".vtu", ".vtk", ".unv", ".bdf", ".inp"}) {
    const auto path = scratch.path(std::string("a") + extension);
    write_mesh_file(path, file);
    const MeshFile after = read_mesh_file(path);
    auto found = check_cells(after, 1e-5);
    EXPECT_EQ(after.mesh.element_count(), file.mesh.element_count()) << extension;
    EXPECT_EQ(after.mesh.blocks.front().type, ElementType::tetrahedron10);
    EXPECT_EQ(found["triangle6"], expected.at("triangle6")) << extension;
    EXPECT_EQ(found["edge3"], expected.at("edge3")) << extension;
  }
}

// NASTRAN needs no marks where a card goes on.
TEST(SecondOrderNastran, IsReadWithAndWithoutMarks) {
  const Scratch scratch;
  const std::string grid =
      "BEGIN BULK\n"
      "GRID    1               0.      0.      0.\nGRID    2               1.      0.      0.\n"
      "GRID    3               0.      1.      0.\nGRID    4               0.      0.      1.\n"
      "GRID    5               .5      0.      0.\nGRID    6               .5      .5      0.\n"
      "GRID    7               0.      .5      0.\nGRID    8               0.      0.      .5\n"
      "GRID    9               .5      0.      .5\nGRID    10              0.      .5      .5\n";
  const std::string first = "CTETRA  1       1       1       2       3       4       5       6";
  const std::string rest = "7       8       9       10\nENDDATA\n";
  for (const std::string& text :
       {grid + first + "       +\n+       " + rest, grid + first + "       +A1\n+A1     " + rest,
        grid + first + "\n        " + rest, grid + first + "\r\n        " + rest,
        grid + "CTETRA,1,1,1,2,3,4,5,6,+\n+,7,8,9,10\nENDDATA\n"}) {
    test::put_bytes(scratch.path("a.bdf"), text);
    const MeshFile file = read_mesh_file(scratch.path("a.bdf"));
    EXPECT_EQ(check_cells(file)["tetrahedron10"], 1) << text;
    write_mesh_file(scratch.path("b.bdf"), file);
    EXPECT_EQ(test::bytes_of(scratch.path("b.bdf")), text);
  }
}

#endif

// --- what is wrong ------------------------------------------------------------------

TEST(SecondOrder, AndLinearElementsInOneMeshAreNamed) {
  const Scratch scratch;
  Mesh mesh = crooked_element(ElementType::tetrahedron10);
  mesh.blocks.push_back({ElementType::wedge, {0, 1, 2, 4, 5, 6}});
  write_mesh_file(scratch.path("a.vtu"), MeshFile(mesh));

  const MeshFile file = read_mesh_file(scratch.path("a.vtu"));
  const auto [reason, text] =
      error_of([&] { validate(MeshTopology(file.mesh).view(), file.mesh.positions_view()); });

  EXPECT_EQ(reason, "MIXED_ORDERS");
  EXPECT_THAT(text, HasSubstr("block 1 (wedge) and block 0 (tetrahedron10)"));
}

TEST(SecondOrder, CellsWithAnotherNumberOfNodesAreNamed) {
  const Scratch scratch;
  test::put_bytes(scratch.path("a.vtk"),
                  "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                  "POINTS 10 float\n0 0 0 1 0 0 0 1 0 0 0 1 .5 0 0 .5 .5 0 0 .5 0 0 0 .5\n"
                  ".5 0 .5 0 .5 .5\nCELLS 1 10\n9 0 1 2 3 4 5 6 7 8\nCELL_TYPES 1\n24\n");

  const auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch.path("a.vtk")); });

  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("element 0 is of the type quadratic tetra (VTK cell type 24) with 9 "
                              "nodes"));
}

}  // namespace
}  // namespace meshsmooth::formats
