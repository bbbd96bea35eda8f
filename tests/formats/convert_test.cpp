// Data, groups and ids: in the same format, and from one to another.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <cmath>
#include <limits>

#include "generate/generate.hpp"
#include "node_sets.hpp"
#include "scratch.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::fixture;
using test::move_nodes;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

vtkSmartPointer<vtkUnstructuredGrid> read_grid(const std::filesystem::path& path) {
  const vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutput();
}

/// Two tetrahedra with a triangle and an edge between them in the list, and
/// data of every kind.
void write_sample(const std::filesystem::path& path) {
  const vtkNew<vtkUnstructuredGrid> grid;
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& [x, y, z] :
       {std::array{0.1, 0., 0.}, {1., 0., 0.}, {0., 1., 0.}, {0., 0., 1.}, {1., 1., 1.}}) {
    points->InsertNextPoint(x, y, z);
  }
  grid->SetPoints(points);
  constexpr std::array<vtkIdType, 4> kLower = {0, 1, 2, 3};
  constexpr std::array<vtkIdType, 3> kBetween = {1, 2, 3};
  constexpr std::array<vtkIdType, 2> kEdge = {1, 2};
  constexpr std::array<vtkIdType, 4> kUpper = {1, 4, 2, 3};
  grid->InsertNextCell(VTK_TETRA, 4, kLower.data());
  grid->InsertNextCell(VTK_TRIANGLE, 3, kBetween.data());
  grid->InsertNextCell(VTK_LINE, 2, kEdge.data());
  grid->InsertNextCell(VTK_TETRA, 4, kUpper.data());

  const vtkNew<vtkDoubleArray> velocity;
  velocity->SetName("velocity");
  velocity->SetNumberOfComponents(3);
  for (int node = 0; node < 5; ++node) velocity->InsertNextTuple3(node, 0.1 * node, 1.0 / 3);
  grid->GetPointData()->AddArray(velocity);
  const vtkNew<vtkIntArray> material;
  material->SetName("material");
  for (const int value : {7, 8, 9, 10}) material->InsertNextValue(value);
  grid->GetCellData()->SetScalars(material);
  const vtkNew<vtkStringArray> title;
  title->SetName("title");
  title->InsertNextValue("a sample");
  grid->GetFieldData()->AddArray(title);

  const vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(grid);
  writer->Write();
}

class VtkFormats : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Convert, VtkFormats, ::testing::Values("out.vtu", "out.vtk"));

TEST_P(VtkFormats, KeepDataLowerDimensionalCellsAndElementOrder) {
  const Scratch scratch;
  write_sample(scratch.path("in.vtu"));
  MeshFile file = read_mesh_file(scratch.path("in.vtu"));
  EXPECT_EQ(file.mesh.element_count(), 2u);
  EXPECT_EQ(file.file_element_id(1), 3);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_THAT(file.lower_dimensional_nodes(), ElementsAre(1, 2, 3));
  move_nodes(file.mesh);
  write_mesh_file(scratch.path(GetParam()), file);
  // Through the format under test and on to one that this test can look into.
  const MeshFile after = read_mesh_file(scratch.path(GetParam()));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  write_mesh_file(scratch.path("look.vtu"), after);

  const auto before = read_grid(scratch.path("in.vtu"));
  const auto grid = read_grid(scratch.path("look.vtu"));
  ASSERT_EQ(grid->GetNumberOfCells(), 4);
  for (vtkIdType cell = 0; cell < 4; ++cell) {
    EXPECT_EQ(grid->GetCellType(cell), before->GetCellType(cell));
  }
  auto* velocity = grid->GetPointData()->GetArray("velocity");
  ASSERT_NE(velocity, nullptr);
  EXPECT_EQ(velocity->GetComponent(4, 2), 1.0 / 3);
  EXPECT_EQ(velocity->GetComponent(4, 1), 0.1 * 4);
  auto* material = grid->GetCellData()->GetArray("material");
  ASSERT_NE(material, nullptr);
  EXPECT_EQ(material->GetDataType(), VTK_INT);
  EXPECT_EQ(material->GetComponent(3, 0), 10);
  EXPECT_EQ(grid->GetCellData()->GetScalars(), material);
  auto* title = vtkStringArray::SafeDownCast(grid->GetFieldData()->GetAbstractArray("title"));
  ASSERT_NE(title, nullptr);
  EXPECT_EQ(title->GetValue(0), "a sample");
}

TEST_P(VtkFormats, CarryTheQualityOfElementsByTheNamesOfTheMetrics) {
  const Scratch scratch;
  write_sample(scratch.path("in.vtu"));
  MeshFile file = read_mesh_file(scratch.path("in.vtu"));
  file.element_quality = {{QualityMetric::mean_ratio, QualityMetric::min_angle},
                          {0.25F, 0.5F, 30.0F, std::numeric_limits<float>::quiet_NaN()}};
  write_mesh_file(scratch.path(GetParam()), file);
  write_mesh_file(scratch.path("look.vtu"), read_mesh_file(scratch.path(GetParam())));

  const auto grid = read_grid(scratch.path("look.vtu"));
  auto* ratio = grid->GetCellData()->GetArray("mean_ratio");
  ASSERT_NE(ratio, nullptr);
  EXPECT_EQ(ratio->GetDataType(), VTK_FLOAT);
  EXPECT_EQ(ratio->GetComponent(0, 0), 0.25);
  EXPECT_TRUE(std::isnan(ratio->GetComponent(1, 0)));  // a triangle
  EXPECT_TRUE(std::isnan(ratio->GetComponent(2, 0)));  // an edge
  EXPECT_EQ(ratio->GetComponent(3, 0), 0.5);
  auto* angle = grid->GetCellData()->GetArray("min_angle");
  ASSERT_NE(angle, nullptr);
  EXPECT_EQ(angle->GetComponent(0, 0), 30);
  EXPECT_TRUE(std::isnan(angle->GetComponent(3, 0)));
  EXPECT_NE(grid->GetCellData()->GetArray("material"), nullptr);
}

TEST(ElementQuality, ReplacesTheArrayOfAnEarlierFile) {
  const Scratch scratch;
  MeshFile file(meshsmooth::test::two_tets());
  for (const float value : {0.25F, 0.75F}) {
    file.element_quality = {{QualityMetric::mean_ratio}, {value, value}};
    write_mesh_file(scratch.path("out.vtu"), file);
    file = read_mesh_file(scratch.path("out.vtu"));
  }

  const auto grid = read_grid(scratch.path("out.vtu"));
  EXPECT_EQ(grid->GetCellData()->GetNumberOfArrays(), 1);
  EXPECT_EQ(grid->GetCellData()->GetArray("mean_ratio")->GetComponent(1, 0), 0.75);
}

TEST(ElementQuality, IsCarriedBySurfaces) {
  const Scratch scratch;
  MeshFile file(meshsmooth::test::lattice(ElementType::triangle, 3));
  const std::size_t count = file.mesh.element_count();
  file.element_quality = {{QualityMetric::min_angle}, std::vector<float>(count, 45.0F)};
  write_mesh_file(scratch.path("out.vtp"), file);
  write_mesh_file(scratch.path("look.vtu"), read_mesh_file(scratch.path("out.vtp")));

  const auto grid = read_grid(scratch.path("look.vtu"));
  auto* angle = grid->GetCellData()->GetArray("min_angle");
  ASSERT_NE(angle, nullptr);
  EXPECT_EQ(angle->GetNumberOfTuples(), static_cast<vtkIdType>(count));
  EXPECT_EQ(angle->GetComponent(0, 0), 45);
}

TEST(ElementQuality, IsRefusedByNameWhereAFormatHasNoCellArrays) {
  const Scratch scratch;
  MeshFile file(meshsmooth::test::lattice(ElementType::triangle, 3));
  file.element_quality = {{QualityMetric::min_angle},
                          std::vector<float>(file.mesh.element_count(), 45.0F)};
  for (const char* name : {"out.stl", "out.ply", "out.obj"}) {
    const auto [reason, text] = error_of([&] { write_mesh_file(scratch.path(name), file); });
    EXPECT_EQ(reason, "ARRAYS_NOT_SUPPORTED");
    EXPECT_THAT(text, HasSubstr("with them are .vtu .vtk .vtp"));
    EXPECT_FALSE(std::filesystem::exists(scratch.path(name)));
  }
}

#if defined(MESHSMOOTH_WITH_GMSH)

TEST(Convert, CarriesGroupsIdsAndDataFromMshToVtuAndBack) {
  const Scratch scratch;
  write_mesh_file(scratch.path("a.vtu"), read_mesh_file(fixture("groups.msh")));
  const auto grid = read_grid(scratch.path("a.vtu"));
  auto* physical = grid->GetCellData()->GetArray("gmsh:physical");
  ASSERT_NE(physical, nullptr);
  EXPECT_EQ(physical->GetComponent(0, 0), 7);
  EXPECT_EQ(physical->GetComponent(2, 0), 9);
  EXPECT_EQ(grid->GetPointData()->GetArray("temp")->GetComponent(1, 0), 2.5);
  EXPECT_EQ(grid->GetPointData()->GetArray("node_id")->GetComponent(5, 0), 99);

  write_mesh_file(scratch.path("b.msh"), read_mesh_file(scratch.path("a.vtu")));
  const std::string text = bytes_of(scratch.path("b.msh"));
  EXPECT_THAT(text, HasSubstr("3 9 \"rock\""));
  EXPECT_THAT(text, HasSubstr("\"temp\""));
  const MeshFile before = read_mesh_file(fixture("groups.msh"));
  const MeshFile after = read_mesh_file(scratch.path("b.msh"));
  EXPECT_TRUE(after.mesh.positions == before.mesh.positions);
  test::expect_same_connectivity(after.mesh, before.mesh);
  EXPECT_EQ(after.file_element_id(1), 207);
  EXPECT_EQ(after.file_node_id(5), 99);
  EXPECT_THAT(after.lower_dimensional_nodes(), ElementsAre(0, 1, 2));
}

TEST(Convert, CarriesVectorsAndLargeIdsOfMshToVtu) {
  const Scratch scratch;
  std::string text = bytes_of(fixture("groups.msh"));
  text.replace(text.find("\n99 5"), 3, "\n5000000000");
  text +=
      "$NodeData\n1\n\"flow\"\n1\n0\n3\n0\n3\n1\n40 1 2 3\n$EndNodeData\n"
      "$ElementData\n1\n\"stress\"\n1\n0\n3\n0\n9\n1\n205 1 2 3 4 5 6 7 8 9\n$EndElementData\n";
  put_bytes(scratch.path("A.MSH"), text);
  const MeshFile file = read_mesh_file(scratch.path("A.MSH"));
  write_mesh_file(scratch.path("a.vtu"), file);
  const auto grid = read_grid(scratch.path("a.vtu"));
  EXPECT_EQ(grid->GetPointData()->GetArray("flow")->GetNumberOfComponents(), 3);
  EXPECT_EQ(grid->GetPointData()->GetArray("flow")->GetComponent(3, 1), 2);
  EXPECT_EQ(grid->GetCellData()->GetArray("stress")->GetComponent(1, 8), 9);
  EXPECT_EQ(grid->GetPointData()->GetArray("node_id")->GetComponent(5, 0), 5000000000);
  EXPECT_EQ(grid->GetCellData()->GetArray("gmsh:geometrical")->GetDataType(), VTK_INT);

  write_mesh_file(scratch.path("B.Msh"), read_mesh_file(scratch.path("a.vtu")));
  const MeshFile again = read_mesh_file(scratch.path("B.Msh"));
  EXPECT_EQ(find_node_vectors(again, "flow")[3].z, 3);
  EXPECT_EQ(find_node_set(again, "wall"), find_node_set(file, "wall"));
}

// MEDIT numbers nodes by their order; those in no element have their place, too.
TEST(Convert, KeepsUnusedNodesAndReferencesInMedit) {
  const Scratch scratch;
  const MeshFile before = read_mesh_file(fixture("groups.msh"));
  write_mesh_file(scratch.path("a.mesh"), before);
  const MeshFile after = read_mesh_file(scratch.path("a.mesh"));
  EXPECT_TRUE(after.mesh.positions == before.mesh.positions);
  test::expect_same_connectivity(after.mesh, before.mesh);
  EXPECT_THAT(bytes_of(scratch.path("a.mesh")), HasSubstr("Tetrahedra\n2\n1 2 3 4 9\n2 5 3 4 9\n"));
}

TEST(Convert, CarriesPhysicalGroupsToUnvAndBack) {
  const Scratch scratch;
  const MeshFile before = read_mesh_file(fixture("groups.msh"));
  write_mesh_file(scratch.path("a.unv"), before);
  const MeshFile unv = read_mesh_file(scratch.path("a.unv"));
  EXPECT_EQ(unv.file_node_id(5), 99);
  EXPECT_EQ(unv.file_element_id(1), 207);
  for (const char* name : {"wall", "rock"}) {
    EXPECT_EQ(find_node_set(unv, name), find_node_set(before, name));
  }
  write_mesh_file(scratch.path("b.vtu"), unv);
  const MeshFile vtu = read_mesh_file(scratch.path("b.vtu"));
  for (const char* name : {"wall", "rock"}) {
    EXPECT_EQ(find_node_set(vtu, name), find_node_set(before, name));
  }
}

TEST(Convert, WritesAbaqusWithAllDigitsAndGroups) {
  const Scratch scratch;
  write_mesh_file(scratch.path("a.inp"), read_mesh_file(fixture("groups.msh")));
  const std::string text = bytes_of(scratch.path("a.inp"));
  EXPECT_THAT(text, HasSubstr("20, 1.0000000000000002, 0, 0"));
  EXPECT_THAT(text, HasSubstr("ELSET=rock"));
}

TEST(Convert, WritesNastranWithDecimalPoints) {
  const Scratch scratch;
  write_mesh_file(scratch.path("a.bdf"), read_mesh_file(fixture("mixed.msh")));
  const MeshFile after = read_mesh_file(scratch.path("a.bdf"));
  EXPECT_EQ(after.mesh.element_count(), 350u);
  EXPECT_THAT(bytes_of(scratch.path("a.bdf")), HasSubstr("1.              "));
}

#endif

TEST(Convert, CarriesTetGensAttributesAndMarkersToVtu) {
  const Scratch scratch;
  write_mesh_file(scratch.path("a.vtu"), read_mesh_file(fixture("tetgen.node")));
  const auto grid = read_grid(scratch.path("a.vtu"));
  EXPECT_EQ(grid->GetPointData()->GetArray("tetgen:attribute_0")->GetComponent(8, 0), 7.25);
  EXPECT_EQ(grid->GetPointData()->GetArray("tetgen:marker")->GetComponent(1, 0), 2);
  EXPECT_EQ(grid->GetCellData()->GetArray("tetgen:attribute_0")->GetComponent(1, 0), 1.5);
  write_mesh_file(scratch.path("b.ele"), read_mesh_file(scratch.path("a.vtu")));
  EXPECT_THAT(bytes_of(scratch.path("b.node")), HasSubstr("8 0.5 0.43 0.57 7.25 0"));
}

struct Impossible {
  const char* extension;
  Mesh (*generate)();
};
void PrintTo(const Impossible& impossible, std::ostream* out) { *out << impossible.extension; }

std::vector<Impossible> impossible() {
  const auto volumes = [] { return generate_mixed(100, 1); };
  std::vector<Impossible> cases = {{".stl", volumes},
                                   {".obj", volumes},
                                   {".ply", volumes},
                                   {".vtp", volumes},
                                   {".node", [] { return generate_sphere(100, 1); }}};
#if defined(MESHSMOOTH_WITH_GMSH)
  for (const char* extension : {".unv", ".inp"}) cases.push_back({extension, volumes});
#endif
  return cases;
}

class Refused : public ::testing::TestWithParam<Impossible> {};
INSTANTIATE_TEST_SUITE_P(Convert, Refused, ::testing::ValuesIn(impossible()),
                         [](const auto& param) {
                           return std::string(param.param.extension).substr(1);
                         });

TEST_P(Refused, IsAnElementThatTheFormatCannotCarry) {
  const Scratch scratch;
  const auto path = scratch.path(std::string("a") + GetParam().extension);
  const auto [reason, text] =
      error_of([&] { write_mesh_file(path, MeshFile(GetParam().generate())); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, ::testing::StartsWith(path.string() + ": "));
  EXPECT_EQ(scratch.file_count(), 0u);
}

}  // namespace
}  // namespace meshsmooth::formats
