// Legacy ".vtk" files come back as they were, but for their coordinates; what VTK's reader does not
// know or drops is read or refused with the place.

#include <gmock/gmock.h>

#include <cmath>

#include "compare.hpp"
#include "content.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// A number as binary files of this format have it.
template <class T>
std::string big_endian(T value) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  return {bytes.rbegin(), bytes.rend()};
}

template <class T>
std::string big_endian(std::initializer_list<T> values) {
  std::string bytes;
  for (const T value : values) bytes += big_endian(value);
  return bytes;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

std::string grid(const std::string& points, const std::string& cells,
                 const std::string& data = "") {
  return "# vtk DataFile Version 2.0\nA title,  with blanks \nASCII\nDATASET UNSTRUCTURED_GRID\n" +
         points + cells + data;
}

const std::string kTwoTriangles = "CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5\n5\n";
const std::string kSquare = "POINTS 4 double\n0 0 0 1 0 0\n1 1 0   0 1.0 0\n";

class LegacyVtk : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.vtk"), text);
    return read_mesh_file(scratch_.path("in.vtk"));
  }
  /// Written with the third node at (0.1, 1e-7, -3).
  [[nodiscard]] std::string moved(const std::string& text) const {
    MeshFile file = read(text);
    const MeshFile before = file;
    std::visit([](auto& nodes) { nodes[2] = {0.1F, 1e-7F, -3}; }, file.mesh.positions);
    if (auto* nodes = std::get_if<std::vector<Vec3d>>(&file.mesh.positions)) {
      (*nodes)[2] = {0.1, 1e-7, -3};
    }
    write_mesh_file(scratch_.path("out.vtk"), file);
    const MeshFile after = read_mesh_file(scratch_.path("out.vtk"));
    EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
    const FileDifference difference = compare_files(before, after);
    EXPECT_THAT(difference.differences, IsEmpty());
    EXPECT_EQ(difference.compared_by, ComparedBy::bytes);
    return bytes_of(scratch_.path("out.vtk"));
  }
  [[nodiscard]] std::pair<std::string, std::string> refusal(const std::string& text) const {
    put_bytes(scratch_.path("in.vtk"), text);
    return error_of([&] { (void)read_mesh_file(scratch_.path("in.vtk")); });
  }

  const Scratch scratch_;
};

TEST_F(LegacyVtk, TextKeepsEveryByteButCoordinates) {
  const std::string text =
      grid(kSquare, kTwoTriangles,
           "POINT_DATA 4\nSCALARS s float\nLOOKUP_TABLE default\n1. 2e0\n3 4\n"
           "LOOKUP_TABLE mine 1\n0 0 1 1\nNORMALS n float\n" +
               std::string(12, '1').insert(1, " ").insert(3, " ") + " 1 2 3 4 5 6 7 8 9\n");
  EXPECT_EQ(moved(text), replaced(text, "1 1 0   0", "0.1 1e-07 -3   0"));
}

TEST_F(LegacyVtk, SinglePrecisionIsWrittenWithItsOwnDigits) {
  const std::string text = grid("POINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1.10 0\n", kTwoTriangles);
  EXPECT_EQ(moved(text), replaced(text, "1 1 0 0 1.10", "0.1 1e-07 -3 0 1.10"));
}

TEST_F(LegacyVtk, WholeNumbersBecomeReal) {
  const std::string text = grid("POINTS 4 int\n0 0 0 1 0 0 1 1 0 0 1 0\n", kTwoTriangles);
  EXPECT_EQ(moved(text),
            replaced(text, "int\n0 0 0 1 0 0 1 1 0", "double\n0 0 0 1 0 0 0.1 1e-07 -3"));
  const MeshFile file = read(text);
  write_mesh_file(scratch_.path("same.vtk"), file);
  EXPECT_EQ(bytes_of(scratch_.path("same.vtk")), text);
}

TEST_F(LegacyVtk, BinaryKeepsEveryByteButCoordinates) {
  const std::string start = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n";
  const std::string cells = "CELLS 2 8\n" + big_endian({3, 0, 1, 2, 3, 0, 2, 3}) +
                            "\nCELL_TYPES 2\n" + big_endian({5, 5}) +
                            "\nFIELD FieldData 2\nPOINTS 1 4 char\n\n\nxy\nname 1 1 "
                            "string\n\xC5POINT\n";
  const auto file = [&](Vec3d third, auto real) {
    using Real = decltype(real);
    std::string points;
    for (const Vec3d& at : {Vec3d{}, Vec3d{1, 0, 0}, third, Vec3d{0, 1, 0}}) {
      points +=
          big_endian({static_cast<Real>(at.x), static_cast<Real>(at.y), static_cast<Real>(at.z)});
    }
    return start + "POINTS 4 " + (sizeof(Real) == 4 ? "float" : "double") + "\n" + points + "\n" +
           cells;
  };
  EXPECT_EQ(moved(file({1, 1, 0}, float{})), file({0.1, 1e-7, -3}, float{}));
  EXPECT_EQ(moved(file({1, 1, 0}, double{})), file({0.1, 1e-7, -3}, double{}));
}

TEST_F(LegacyVtk, Version5KeepsItsListsOfCells) {
  const std::string text =
      "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 "
      "0 1 1 0 0 1 0\nMETADATA\nINFORMATION 0\n\nCELLS 3 6\nOFFSETS vtktypeint64\n0 3 6\n"
      "CONNECTIVITY vtktypeint64\n0 1 2 0 2 3\nCELL_TYPES 2\n5\n5\n";
  EXPECT_EQ(moved(text), replaced(text, "0 1 1 0 0", "0 0.1 1e-07 -3 0"));
}

TEST_F(LegacyVtk, SurfacesKeepTheirLists) {
  const std::string text =
      "# vtk DataFile Version 1.0\nt\nASCII\ndataset polydata\nFIELD f 1\nTIME 1 1 double\n0.5\n"
      "POINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\nPOLYGONS 2 8\n3 0 1 2\n3 0 2 3\nLINES 1 3\n2 0 1\n"
      "VERTICES 1 2\n1 3\nCELL_DATA 4\nSCALARS c int 1\nLOOKUP_TABLE default\n1 2 3 4\n";
  EXPECT_EQ(moved(text), replaced(text, "0 1 1 0 0", "0 0.1 1e-07 -3 0"));
  EXPECT_EQ(read(text).lower_dimensional_cell_count(), 2);
}

TEST_F(LegacyVtk, CellArraysAreAddedInTheFilesOwnVersionEncodingAndTitle) {
  MeshFile file = read(grid(kSquare, kTwoTriangles));
  file.element_quality = {{QualityMetric::mean_ratio}, {0.25F, 0.5F}};
  write_mesh_file(scratch_.path("out.vtk"), file);
  const std::string text = bytes_of(scratch_.path("out.vtk"));
  EXPECT_THAT(text, StartsWith("# vtk DataFile Version 2.0\nA title,  with blanks \nASCII\n"));
  EXPECT_THAT(text, HasSubstr("0.25 0.5"));
  EXPECT_THAT(text, Not(HasSubstr("OFFSETS")));
  EXPECT_EQ(read_mesh_file(scratch_.path("out.vtk")).mesh.element_count(), 2u);
}

// --- cells ---------------------------------------------------------------------

// Two voxels along x, a pixel at their end.
const std::string kVoxels = grid(
    "POINTS 12 double\n0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0\n0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1\n",
    "CELLS 3 23\n8 0 1 3 4 6 7 9 10\n8 1 2 4 5 7 8 10 11\n4 2 5 8 11\nCELL_TYPES 3\n11\n11\n8\n");

TEST_F(LegacyVtk, VoxelsAndPixelsAreHexahedraAndQuads) {
  const MeshFile file = read(kVoxels);
  ASSERT_EQ(file.mesh.blocks.size(), 1u);
  EXPECT_EQ(file.mesh.blocks[0].type, ElementType::hexahedron);
  EXPECT_THAT(file.mesh.blocks[0].nodes,
              ElementsAre(0, 1, 4, 3, 6, 7, 10, 9, 1, 2, 5, 4, 7, 8, 11, 10));
  EXPECT_EQ(measure_quality(file.mesh).inverted_count, 0);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 1);

  write_mesh_file(scratch_.path("same.vtk"), file);
  EXPECT_EQ(bytes_of(scratch_.path("same.vtk")), kVoxels) << "where nothing moved they stay";
}

TEST_F(LegacyVtk, VoxelsOfWhichANodeMovesBecomeHexahedra) {
  MeshFile file = read(kVoxels);
  const MeshFile before = file;
  std::get<std::vector<Vec3d>>(file.mesh.positions)[5].y = 1.25;
  write_mesh_file(scratch_.path("out.vtk"), file);

  std::string expected = replaced(kVoxels, "2 1 0\n", "2 1.25 0\n");
  expected = replaced(expected, "8 1 2 4 5 7 8 10 11", "8 1 2 5 4 7 8 11 10");
  expected = replaced(expected, "4 2 5 8 11", "4 2 5 11 8");
  expected = replaced(expected, "11\n11\n8\n", "11\n12\n9\n");
  EXPECT_EQ(bytes_of(scratch_.path("out.vtk")), expected);
  const MeshFile after = read_mesh_file(scratch_.path("out.vtk"));
  test::expect_same_connectivity(before.mesh, after.mesh);
  EXPECT_THAT(compare_files(before, after).differences, IsEmpty());
}

TEST_F(LegacyVtk, VoxelsBecomeHexahedraInOtherFormatsToo) {
  MeshFile file = read(kVoxels);
  std::get<std::vector<Vec3d>>(file.mesh.positions)[5].y = 1.25;
  for (const char* name : {"out.vtu", "out.su2"}) {
    write_mesh_file(scratch_.path(name), file);
    const MeshFile after = read_mesh_file(scratch_.path(name));
    test::expect_same_connectivity(file.mesh, after.mesh);
    EXPECT_EQ(measure_quality(after.mesh).inverted_count, 0);
  }
}

TEST_F(LegacyVtk, HoldsStripsPolygonsAndPolyhedra) {
  const std::string surface =
      grid("POINTS 10 float\n0 0 0 1 0 0 1 1 0 0 1 0 2 0 0 2 1 0 3 0 0 3 1 0 0 2 0 1 2 0\n",
           "CELLS 3 15\n3 0 1 2\n4 4 5 6 7\n5 2 3 8 9 2\nCELL_TYPES 3\n5\n6\n7\n");
  const MeshFile file = read(surface);
  EXPECT_EQ(file.mesh.element_count(), 1u);
  ASSERT_EQ(file.held_cells().size(), 2u);
  EXPECT_THAT(file.held_cells()[0].name, HasSubstr("triangle strip"));
  EXPECT_THAT(file.held_cells()[1].name, HasSubstr("polygon"));
  EXPECT_THAT(file.mesh.fixed, ElementsAre(0, 0, 1, 1, 1, 1, 1, 1, 1, 1));

  const std::string volume =
      grid("POINTS 8 double\n0 0 0 1 0 0 0 1 0 0 0 1 5 0 0 6 0 0 5 1 0 5 0 1\n",
           "CELLS 2 23\n4 0 1 2 3\n17 4 3 4 5 6 3 4 5 7 3 5 6 7 3 4 6 7\nCELL_TYPES 2\n10\n42\n");
  const MeshFile polyhedra = read(volume);
  ASSERT_EQ(polyhedra.held_cells().size(), 1u);
  EXPECT_EQ(polyhedra.held_cells()[0].count, 1);
  EXPECT_THAT(polyhedra.mesh.fixed, ElementsAre(0, 0, 0, 0, 1, 1, 1, 1));
  EXPECT_EQ(moved(volume), replaced(volume, "0 1 0 0 0 1 5", "0.1 1e-07 -3 0 0 1 5"));
}

// --- numbers that VTK's reader does not know -------------------------------------

TEST_F(LegacyVtk, ReadsNumbersThatAreNone) {
  const std::string text =
      grid(kSquare, kTwoTriangles,
           "POINT_DATA 4\nSCALARS t double 1\nLOOKUP_TABLE default\nnan -NaN(ind) inf 4\n"
           "SCALARS f float 1\nLOOKUP_TABLE default\n-inf -1.#IND 1e99 -1D+1\n");
  const MeshFile file = read(text);
  const auto values = file.content()->dataset->node_column("t")->values;
  EXPECT_TRUE(std::isnan(values[0]) && std::isnan(values[1]));
  EXPECT_EQ(values[2], std::numeric_limits<double>::infinity());
  EXPECT_EQ(values[3], 4);
  const auto singles = file.content()->dataset->node_column("f")->values;
  EXPECT_EQ(singles[0], -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(singles[1]));
  EXPECT_EQ(singles[2], std::numeric_limits<double>::infinity());
  EXPECT_EQ(singles[3], -10);
  EXPECT_EQ(moved(text), replaced(text, "1 1 0   0", "0.1 1e-07 -3   0"));
}

// --- what does not fit ------------------------------------------------------------

TEST_F(LegacyVtk, SaysWhereItFails) {
  const auto text_of = [&](const std::string& text) { return refusal(text).second; };
  EXPECT_THAT(text_of(grid(replaced(kSquare, "1.0", "one"), kTwoTriangles)),
              HasSubstr("line 7: expected a number, found \"one\""));
  EXPECT_THAT(text_of(grid(kSquare, replaced(kTwoTriangles, "2 8", "2 9"))),
              HasSubstr("expected a number, found \"CELL_TYPES\""));
  EXPECT_THAT(text_of(grid(kSquare, replaced(kTwoTriangles, "3 0 2 3", "9 0 2 3"))),
              HasSubstr("cells: cell 1 of 2 goes beyond the 8 numbers of the list"));
  EXPECT_THAT(text_of(grid(kSquare, replaced(kTwoTriangles, "3 0 2 3", "2 0 2 3"))),
              HasSubstr("cells: 8 numbers are announced, but the 2 cells have 7"));
  EXPECT_THAT(text_of(grid(kSquare, replaced(kTwoTriangles, "TYPES 2\n5\n5", "TYPES 1\n5"))),
              HasSubstr("there are 2 CELLS and 1 CELL_TYPES"));
  EXPECT_THAT(text_of(grid(kSquare, kTwoTriangles, "POINT_DATA 5\n")),
              HasSubstr("POINT_DATA is for 5, there are 4 points"));
  EXPECT_THAT(text_of(grid(kSquare, kTwoTriangles, "CELL_DATA 2\nGHOSTS 3\n")),
              HasSubstr("line 15: expected the keyword of a data array, found \"GHOSTS\""));
  EXPECT_EQ(refusal(grid(kSquare, kTwoTriangles, "CELL_DATA 2\nSCALARS a int\n")).first,
            "FILE_TRUNCATED");
}

TEST_F(LegacyVtk, StructuredDataAreRefusedWithAdvice) {
  const auto [reason, text] = refusal(
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS 2 2 1\nPOINTS 4 "
      "float\n0 0 0 1 0 0 0 1 0 1 1 0\n");
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("it holds a STRUCTURED_GRID; only UNSTRUCTURED_GRID and POLYDATA can "
                              "be smoothed: convert it to an unstructured grid"));
}

TEST_F(LegacyVtk, EmptyListsAreAllowed) {
  const std::string text =
      "# vtk DataFile Version 5.1\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 1 1 0 "
      "0 "
      "1 0\nVERTICES 0 0\nLINES 1 0\nOFFSETS vtktypeint64\n0\nCONNECTIVITY vtktypeint64\nPOLYGONS "
      "3 6\nOFFSETS vtktypeint64\n0 3 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 2 3\n";
  EXPECT_EQ(read(text).mesh.element_count(), 2u);
  EXPECT_EQ(moved(text), replaced(text, "0 1 1 0 0", "0 0.1 1e-07 -3 0"));
}

}  // namespace
}  // namespace meshsmooth::formats
