// Medit's meshes of text.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"
#include "second_order.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::fixture;
using test::ids_of_set;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Medit : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text, const std::string& name = "in.mesh") const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(
      const std::string& text, const std::string& name = "in.mesh") const {
    return error_of([&] { static_cast<void>(read(text, name)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file,
                                    const std::string& name = "out.mesh") const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }

  const Scratch scratch_;
};

/// A square of four triangles around vertex 5; without the end.
const std::string kPlane =
    "MeshVersionFormatted 2\n\nDimension\n2\n\nVertices\n5\n0 0 1\n1 0 1\n1 1 2\n0 1 2\n"
    "0.4 0.6 0\n\nEdges\n4\n1 2 1\n2 3 2\n3 4 3\n4 1 4\n\nTriangles\n4\n1 2 5 7\n2 3 5 7\n"
    "3 4 5 8\n4 1 5 8\n";
const std::string kCube =
    "MeshVersionFormatted 1\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
    "0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\n";

TEST_F(Medit, KeepsAPlaneMeshInItsPlane) {
  MeshFile file = read(kPlane + "End\n");

  EXPECT_EQ(file.mesh.node_count(), 5U);
  EXPECT_EQ(file.file_node_id(4), 5);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 4);
  EXPECT_EQ(find_regions(file).array, "medit:ref");
  EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 0, 1, 1));
  EXPECT_EQ(written(file), kPlane + "End\n");

  positions_of(file)[4] = {0.5, 1.0 / 3, -0.0};
  EXPECT_THAT(changed_lines(kPlane + "End\n", written(file)),
              ElementsAre("0.5 0.3333333333333333 0"));
  positions_of(file)[4].z = 0.125;
  EXPECT_THAT(error_of([&] { static_cast<void>(written(file)); }).second,
              HasSubstr("node 4 is not in the plane z = 0, where a .mesh file in two dimensions"));
}

TEST_F(Medit, NeedsNoEndWhereNothingIsMissing) {
  EXPECT_EQ(read(kPlane).mesh.element_count(), 4U);
  EXPECT_EQ(written(read(kPlane.substr(0, kPlane.size() - 1))).size(), kPlane.size() - 1);

  const auto triangles = kPlane.find("Triangles");
  const auto [reason, text] = error(kPlane.substr(0, triangles) + "Triangles\n1\n1 2 3 1\n");
  EXPECT_EQ(reason, "FILE_TRUNCATED");
  EXPECT_THAT(text, HasSubstr("there is no End, and 1 vertices are in no element"));
  EXPECT_EQ(error(kPlane + "Tetrahe").first, "FILE_TRUNCATED");
  EXPECT_EQ(error(kPlane.substr(0, kPlane.size() - 6)).first, "FILE_TRUNCATED");
}

TEST_F(Medit, ReadsAnyVersionCommentsAndSectionsInAnyOrder) {
  const std::string text =
      "# a comment: Vertices\nMeshVersionFormatted 0 # of bamg\nDimension 2\n"
      "Identifier \"Vertices and Triangles of 3\"\nTriangles 2 # two\n1 2 3 1 1 3 4 1\n"
      "RequiredVertices 1 1\nNormals\n2\n0 1\nnan 1e-3\nAngleOfCornerBound 10\n"
      "SubDomainFromGeom 1 3 1 1 0\nvertices 4\n0 0 1 # the first\n1 0 1 1 1 1\n+0 1 1\n"
      "SolAtVertices\n4\n1 1\n0.5\n1\n-1e5\ninf\nEND\nnot read\n";
  MeshFile file = read(text);

  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(ids_of_set(file, "RequiredVertices"), ElementsAre(1));
  EXPECT_EQ(written(file), text);
  positions_of(file)[0].x = -0.25;
  EXPECT_THAT(changed_lines(text, written(file)), ElementsAre("-0.25 0 1 # the first"));
}

TEST_F(Medit, ReadsEveryLinearElementTheRightWayRound) {
  const std::string sections[] = {
      "Hexahedra\n1\n1 2 3 4 5 6 7 8 3\n",
      "Hexaedra\n1\n1 2 3 4 5 6 7 8 3\n",
      "Prisms\n2\n1 2 3 5 6 7 3\n1 3 4 5 7 8 3\n",
      "Prisms\n2\n1 3 2 5 7 6 3\n1 4 3 5 8 7 3\n",
      "Pyramids\n3\n1 2 3 4 5 1\n2 6 7 3 5 1\n4 3 7 8 5 1\n",
      "Tetrahedra\n6\n1 2 3 7 1\n1 3 4 7 1\n1 4 8 7 1\n1 8 5 7 1\n1 5 6 7 1\n1 6 2 7 1\n"};
  for (const std::string& section : sections) {
    const std::string text = kCube + section + "Quadrilaterals\n1\n1 2 3 4 9\nEnd\n";
    const MeshFile file = read(text);
    const QualityStats quality = measure_quality(file.mesh);
    EXPECT_EQ(quality.inverted_count, 0) << section;
    EXPECT_NEAR(quality.sum_absolute_volume, 1, 1e-12) << section;
    EXPECT_EQ(file.lower_dimensional_cell_count(), 1);
    EXPECT_EQ(written(file), text);
  }
}

// --- what must stay ------------------------------------------------------------

const std::string kGrid = [] {  // 3 x 3 vertices, four quads
  std::string text = "MeshVersionFormatted 2\nDimension 3\nVertices\n9\n";
  for (int node = 0; node < 9; ++node) {
    text += std::to_string(node % 3) + " " + std::to_string(node / 3) + " 0 0\n";
  }
  return text + "Edges\n3\n1 2 1\n2 5 1\n5 8 1\n" +
         "Quadrilaterals\n2\n1 2 5 4 1\n2 3 6 5 1\nTriangles\n4\n4 5 8 1\n4 8 7 1\n5 6 9 1\n"
         "5 9 8 1\n";
}();

TEST_F(Medit, FixesRequiredEntitiesCornersAndRidges) {
  const struct {
    std::string section;
    std::vector<std::int64_t> nodes;
  } cases[] = {
      {"RequiredVertices\n2\n5\n6\n", {5, 6}},
      {"Corners\n1\n9\n", {9}},
      {"Ridges\n1\n2\n", {2, 5}},
      {"RequiredEdges\n2\n2\n3\n", {2, 5, 8}},
      {"RequiredTriangles\n1\n4\n", {5, 8, 9}},
      {"RequiredQuadrilaterals\n1\n2\n", {2, 3, 5, 6}},
      {"ParallelTriangles\n1\n1\n", {4, 5, 8}},
  };
  for (const auto& [section, nodes] : cases) {
    const std::string name = section.substr(0, section.find('\n'));
    // Also where it comes before the entities that it numbers.
    std::string early = kGrid;
    early.insert(early.find("Vertices"), section);
    for (const std::string& text : {kGrid + section + "End\n", early + "End\n"}) {
      const MeshFile file = read(text);
      EXPECT_EQ(ids_of_set(file, name), nodes);
      std::vector<std::int64_t> fixed;
      for (std::size_t node = 0; node < file.mesh.fixed.size(); ++node) {
        if (file.mesh.fixed[node] != 0) fixed.push_back(static_cast<std::int64_t>(node) + 1);
      }
      EXPECT_EQ(fixed, nodes) << name;
      EXPECT_EQ(written(file), text);
    }
  }
  EXPECT_THAT(read(kGrid + "End\n").mesh.fixed, IsEmpty());
  EXPECT_THAT(read(kCube + "Tetrahedra 1 1 2 3 7 1 RequiredTetrahedra 1 1 End").mesh.fixed,
              ElementsAre(1, 1, 1, 0, 0, 0, 1, 0));
}

// --- elements of second order and above ----------------------------------------

TEST_F(Medit, FindsTheNodesOnEdgesWhateverTheirOrder) {
  const std::string vertices =
      "MeshVersionFormatted 2\nDimension 3\nVertices\n10\n0 0 0 0\n2 0 0 0\n0 2 0 0\n0 0 2 0\n"
      "1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n0 1 1 0\n";
  for (const char* nodes : {"5 6 7 8 9 10", "5 6 7 8 10 9", "10 9 8 7 6 5"}) {
    const MeshFile file = read(vertices + "TetrahedraP2\n1\n1 2 3 4 " + nodes +
                               " 1\nTrianglesP2\n1\n1 2 3 5 6 7 1\nEdgesP2\n1\n1 2 5 1\nEnd\n");
    const std::map<std::string, int> expected = {
        {"tetrahedron10", 1}, {"triangle6", 1}, {"edge3", 1}};
    EXPECT_EQ(test::check_cells(file), expected);
  }
  const auto [reason, text] =
      error(vertices + "TetrahedraP2Ordering 10\n1 1 1 1\nTetrahedraP2 0\nEnd\n");
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("TetrahedraP2Ordering are not read"));
}

TEST_F(Medit, HoldsTheNodesOfElementsThatItCannotSmooth) {
  const std::string text = kCube + "Tetrahedra\n1\n1 2 3 7 1\nPrisms9\n1\n1 2 3 4 5 6 7 8 1 2\n" +
                           "EdgesP3\n2\n1 2 3 4 1\n1 2 3 4 1\nEnd\n";
  const MeshFile file = read(text);

  ASSERT_THAT(file.held_cells(), SizeIs(2));
  EXPECT_EQ(file.held_cells()[0].name, "Prisms9");
  EXPECT_EQ(file.held_cells()[1].count, 2);
  EXPECT_THAT(file.mesh.fixed, ElementsAre(1, 1, 1, 1, 1, 1, 1, 1));
  EXPECT_EQ(error(kCube + "Polyhedra\n1\n8 1 2 3 4 5 6 7 8 1\nEnd\n").first,
            "ELEMENT_NOT_SUPPORTED");
}

// --- errors --------------------------------------------------------------------

TEST_F(Medit, SaysWhatIsWrongWithAFileAndWhere) {
  const std::string head = "MeshVersionFormatted 2\nDimension 3\n";
  const struct {
    std::string text;
    std::string reason;
    std::string what;
  } files[] = {
      {"MeshVersionFormatted 5\n", "FORMAT_ERROR", "line 1: expected a version up to 4"},
      {"MeshVersionFormatted 2\nDimension 1\n", "FORMAT_ERROR", "expected dimension 2 or 3"},
      {"MeshVersionFormatted 2\nVertices\n1\n0 0 0 0\n", "FORMAT_ERROR", "Dimension before"},
      {head + "Vertices\n2\n0 0 0 0\nTriangles\n", "FORMAT_ERROR",
       "line 6: expected a number, found \"Triangles\""},
      {head + "Vertices\n1\n0 0 0 0\n1 1 1 0\n", "FORMAT_ERROR",
       "line 6: expected a keyword after Vertices, found \"1\""},
      {head + "Vertices\n9\n0 0 0 0\n", "FILE_TRUNCATED", "ends too early"},
      {head + "Vertices\n999999\n0 0 0 0\n", "FILE_TRUNCATED", "too short for the 999999"},
      {head + "Vertices\n0\nVertices\n0\n", "FORMAT_ERROR", "expected Vertices once"},
      {kCube + "Triangles\n2\n1 2 3 1\n1 2 9 1\nEnd\n", "FORMAT_ERROR",
       "Triangles: row 2 uses vertex 9, there are only 8"},
      {kCube + "Triangles\n1\n0 2 3 1\nEnd\n", "FORMAT_ERROR", "row 1 uses vertex 0"},
      {kCube + "Corners\n1\n9\nEnd\n", "FORMAT_ERROR",
       "Corners names number 9 of the Vertices, which is not in the file"},
      {kCube + "Edges\n1\n1 2 1\nRidges\n1\n2\nEnd\n", "FORMAT_ERROR",
       "Ridges names number 2 of the Edges"},
      {kCube + "Edges\n1\n1 2 1\nEnd\n", "MESH_EMPTY", "no surface or volume elements"},
      {head + "End\n", "MESH_EMPTY", "no nodes"},
      {"Dear reader,\n", "FORMAT_ERROR", "line 1: expected MeshVersionFormatted, found \"Dear\""},
  };
  for (const auto& [text, reason, what] : files) {
    const auto [found, message] = error(text);
    EXPECT_EQ(found, reason) << text;
    EXPECT_THAT(message, HasSubstr(what)) << text;
    EXPECT_THAT(message, HasSubstr("in.mesh: ")) << text;
  }
}

TEST_F(Medit, NamesOtherProgramsWhoseMeshesAreCalledSo) {
  const std::pair<const char*, const char*> files[] = {
      {"MFEM mesh v1.0\n\ndimension\n2\n", "a file of MFEM; convert it"},
      {"MFEM NC mesh v1.0\n", "a file of MFEM; convert it"},
      {"MFEM NURBS mesh v1.0\n", "a file of MFEM; NURBS"},
      {"% GETFEM MESH FILE\n% GETFEM VERSION 5\n\nBEGIN POINTS LIST\n", "a file of GetFEM"},
      {"BEGIN POINTS LIST\n", "a file of GetFEM"},
      {"mesh3d\ndimension\n3\n", "a file of Netgen"},
      {"$MeshFormat\n2.2 0 8\n", "a file of Gmsh; name it .msh"},
  };
  for (const auto& [text, what] : files) {
    const auto [reason, message] = error(text);
    EXPECT_EQ(reason, "FORMAT_ERROR");
    EXPECT_THAT(message, HasSubstr(what));
  }
  EXPECT_EQ(read("# converted from an MFEM mesh\n" + kPlane).mesh.element_count(), 4U);
}

}  // namespace
}  // namespace meshsmooth::formats
