// Meshes of SU2.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::fixture;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Su2 : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.su2"), text);
    return read_mesh_file(scratch_.path("in.su2"));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file) const {
    write_mesh_file(scratch_.path("out.su2"), file);
    return bytes_of(scratch_.path("out.su2"));
  }

  const Scratch scratch_;
};

const std::string kPlane =
    "NDIME=2\nNPOIN=4\n0 0\n1.5 0 1\n1 1\n0 1 3\n"
    "NELEM=2\n5 0 1 2\n5 0 2 3 1\n";
const std::string kMarker = "NMARK=1\nMARKER_TAG=wall\nMARKER_ELEMS=1\n3 0 1\n";

TEST_F(Su2, ReadsElementsPointsAndMarkers) {
  const MeshFile file = read_mesh_file(fixture("mixed.su2"));

  EXPECT_EQ(file.mesh.node_count(), 12U);
  ASSERT_EQ(file.mesh.blocks.size(), 4U);
  EXPECT_EQ(file.mesh.blocks[2].type, ElementType::wedge);
  EXPECT_THAT(file.mesh.blocks[2].nodes, ElementsAre(1, 9, 5, 2, 10, 6));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 3);
  EXPECT_THAT(find_node_set(file, "lower"), ElementsAre(0, 1, 2, 3, 9, 10));
  EXPECT_THAT(find_node_set(file, "upper"), ElementsAre(4, 5, 8)) << "the name ends at a blank";
  EXPECT_THAT(file.content()->dataset->cell_column("su2:marker")->values,
              ElementsAre(0, 0, 0, 0, 1, 1, 2));
}

TEST_F(Su2, KeepsEveryByteWhereNothingMoved) {
  EXPECT_EQ(written(read_mesh_file(fixture("mixed.su2"))), bytes_of(fixture("mixed.su2")));
}

TEST_F(Su2, ChangesCoordinatesAlone) {
  MeshFile file = read_mesh_file(fixture("mixed.su2"));
  positions_of(file)[1] = {1, 1.0 / 3, -0.0};
  positions_of(file)[11].z = 1e-30;

  EXPECT_THAT(changed_lines(bytes_of(fixture("mixed.su2")), written(file)),
              ElementsAre("1.0\t0.3333333333333333\t0 1", "2 0 1e-30 11"));
  MeshFile after = read_mesh_file(scratch_.path("out.su2"));
  EXPECT_EQ(positions_of(after)[1].y, 1.0 / 3);
}

TEST_F(Su2, KeepsAPlaneMeshInItsPlane) {
  MeshFile file = read(kPlane + kMarker);
  EXPECT_THAT(find_node_set(file, "wall"), ElementsAre(0, 1));
  positions_of(file)[1] = {1.25, 0.5, -0.0};
  EXPECT_THAT(changed_lines(kPlane + kMarker, written(file)), ElementsAre("1.25 0.5 1"));

  positions_of(file)[2].z = 0.125;
  const auto [reason, text] = error_of([&] { static_cast<void>(written(file)); });
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, HasSubstr("node 2 is not in the plane z = 0"));
}

TEST_F(Su2, SkipsWhatIsNotTheMesh) {
  const std::string text = "NZONE= 1\nIZONE= 1\n" + kPlane +
                           "NMARK= 2\nMARKER_TAG= SEND_RECEIVE\nMARKER_ELEMS= 1\nSEND_TO= 1\n"
                           "1 0 0\nMARKER_TAG= wall\nMARKER_ELEMS= 0\n"
                           "NPERIODIC= 1\nPERIODIC_INDEX= 0\n0 0 0\n1 1 1\n2 2 2\n";
  const MeshFile file = read(text);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 0);
  EXPECT_EQ(written(file), text);
}

TEST_F(Su2, SaysWhatIsWrongWithAFileAndWhere) {
  const struct {
    std::string text;
    std::string reason;
    std::string what;
  } files[] = {
      {"0 0\n", "FORMAT_ERROR", "line 1: expected a keyword like NDIME="},
      {"NDIME= 4\n", "FORMAT_ERROR", "line 1: expected 2 or 3 dimensions, found \"4\""},
      {"NZONE= 0\n", "FORMAT_ERROR", "line 1: expected one zone or more, found \"0\""},
      {"NZONE= 2\n" + kPlane, "FILE_TRUNCATED", "NZONE announces 2 zones, there are 1"},
      {"NZONE= 2\nIZONE= 1\n" + kPlane + "IZONE= 2\nNPOIN= 0\n", "FILE_TRUNCATED",
       "zone 2: there is no NELEM="},
      {"NZONE= 2\nIZONE= 1\n" + kPlane + "IZONE= 2\nNELEM= 1\n5 0 1 4\nNPOIN= 3\n0 0\n1 0\n0 1\n",
       "FORMAT_ERROR", "zone 2: element 0 uses node 4, there are only 3"},
      {"NZONE= 2\nIZONE= 1\n" + kPlane + "IZONE= 2\nNDIME= 3\n", "FORMAT_ERROR",
       "as many dimensions as before, found \"3\""},
      {"NZONE= 2\nIZONE= 1\n" + kPlane + "IZONE= 2\nNELEM= 1\n22 0 1 2 3 4 5\n",
       "ELEMENT_NOT_SUPPORTED", "zone 2: element 0 is of the type VTK cell type 22"},
      {"IZONE= one\n", "FORMAT_ERROR", "line 1: expected a number, found \"one\""},
      {"NDIME= 2\n", "FILE_TRUNCATED", "there is no NELEM="},
      {"NDIME= 2\nNELEM= 0\n", "FILE_TRUNCATED", "there is no NPOIN="},
      {"NELEM= 0\nNPOIN= 1\n0 0\n", "FILE_TRUNCATED", "there is no NDIME="},
      {kPlane + "NELEM= 1\n5 0 1 2\n", "FORMAT_ERROR", "line 10: expected NELEM once"},
      {"NDIME= 2\nNPOIN= 9\n0 0\n", "FILE_TRUNCATED", "ends too early"},
      {"NDIME= 2\nNPOIN= 2\n0 0\nNELEM= 0\n", "FORMAT_ERROR", "line 4: expected a number"},
      {"NDIME= 3\nNPOIN= 2\n0 0\n1 1 1\n", "FORMAT_ERROR", "more numbers in the line before"},
      {"NDIME= 2\nNPOIN= 1\n0 x\n", "FORMAT_ERROR", "line 3: expected a number, found \"x\""},
      {"NDIME= 2\nNPOIN= -1\n", "FORMAT_ERROR", "line 2: expected a number, found \"-1\""},
      {"NDIME= 2\nNELEM= 1\n2147483647 0 1 2\n", "ELEMENT_NOT_SUPPORTED",
       "element 0 is of the type VTK cell type 2147483647"},
      {"NDIME= 2\nNELEM= 1\n22 0 1 2 3 4 5\n", "ELEMENT_NOT_SUPPORTED",
       "element 0 is of the type VTK cell type 22; only linear"},
      {"NDIME= 2\nNELEM= 1\n5 0 1 2\nNPOIN= 2\n0 0\n1 0\n", "FORMAT_ERROR",
       "element 0 uses node 2, there are only 2"},
      {kPlane + "NMARK= 1\nMARKER_ELEMS= 1\n3 0 1\n", "FORMAT_ERROR", "MARKER_TAG= before"},
      {kPlane + "NMARK= 1\nMARKER_TAG= a\nMARKER_ELEMS= 1\n3 0 -1\n", "FORMAT_ERROR",
       "expected the number of a node, found \"-1\""},
      {kPlane + "NMARK= 1\nMARKER_TAG= a\nMARKER_ELEMS= 1\n3 0 4\n", "FORMAT_ERROR",
       "element of a marker 0 uses node 4"},
      {kPlane + "NMARK= 2\nMARKER_TAG= a\nMARKER_ELEMS= 0\n", "FILE_TRUNCATED",
       "NMARK announces 2 markers, there are 1"},
      {"NDIME= 2\nNELEM= 0\nNPOIN= 0\n", "MESH_EMPTY", "no nodes"},
  };
  for (const auto& [text, reason, what] : files) {
    const auto [found, message] = error(text);
    EXPECT_EQ(found, reason) << text;
    EXPECT_THAT(message, HasSubstr(what)) << text;
    EXPECT_THAT(message, HasSubstr("in.su2: ")) << text;
  }
}

/// Two zones, which number from 0 each, and their keywords in different orders.
const std::string kZones =
    "% two zones\nNZONE= 2\nIZONE= 1\n" + kPlane + kMarker +
    "IZONE= 2 % the solid\nNMARK=2\nMARKER_TAG=wall\nMARKER_ELEMS=1\n3 1 2\nMARKER_TAG=end\n"
    "MARKER_ELEMS=1\n3 2 0\nNPOIN=3 3\n2 0 0\n3 0 1\n% a comment\n2.5 1\nNDIME=2\n"
    "NELEM=1\n5 0 1 2 0\n";

TEST_F(Su2, ReadsSeveralZonesAsOneMesh) {
  MeshFile file = read(kZones);

  EXPECT_EQ(file.mesh.node_count(), 7U);
  ASSERT_EQ(file.mesh.blocks.size(), 1U);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 0, 2, 3, 4, 5, 6));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 3);
  EXPECT_THAT(find_node_set(file, "wall"), ElementsAre(0, 1, 5, 6)) << "of both zones";
  EXPECT_THAT(find_node_set(file, "end"), ElementsAre(4, 6));
  EXPECT_THAT(find_node_set(file, "zone 2"), ElementsAre(4, 5, 6));
  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "su2:zone");
  EXPECT_THAT(regions.of_element, ElementsAre(0, 0, 1));
  EXPECT_EQ(written(file), kZones);

  positions_of(file)[2] = {1.5, 1, 0};
  positions_of(file)[6].y = 1.25;
  EXPECT_THAT(changed_lines(kZones, written(file)), ElementsAre("1.5 1", "2.5 1.25"));
}

TEST_F(Su2, ReadsKeywordsInAnyOrderAndSmallLetters) {
  const std::string text =
      "npoin= 3 % points\n0 0\n1 0\n\n0 1\nmarker_tag= lower\nmarker_elems= 1\n3 0 1\n"
      "ndime = 2\nnelem=1\n5 0 1 2\n";
  const MeshFile file = read(text);

  EXPECT_EQ(file.mesh.element_count(), 1U);
  EXPECT_THAT(find_node_set(file, "lower"), ElementsAre(0, 1));
  EXPECT_THAT(file.notes(), ElementsAre("there is no NMARK= for its markers"));
  EXPECT_EQ(written(file), text);
}

TEST_F(Su2, CarriesTheMeshOfAnotherFormat) {
  const MeshFile file = read_mesh_file(fixture("tetgen.node"));

  EXPECT_THAT(written(file), HasSubstr("NMARK= 0\n"));

  const MeshFile after = read_mesh_file(scratch_.path("out.su2"));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(after.mesh, file.mesh);
}

#if defined(MESHSMOOTH_WITH_VTK)
TEST_F(Su2, BecomesAVtkFileAndBack) {
  const MeshFile file = read_mesh_file(fixture("mixed.su2"));
  write_mesh_file(scratch_.path("a.vtu"), file);
  (void)written(read_mesh_file(scratch_.path("a.vtu")));

  const MeshFile after = read_mesh_file(scratch_.path("out.su2"));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(after.mesh, file.mesh);
  EXPECT_EQ(find_node_set(after, "marker_1"), find_node_set(file, "lower"));
  EXPECT_EQ(find_node_set(after, "marker_2"), find_node_set(file, "upper"));
}
#endif

#if defined(MESHSMOOTH_WITH_GMSH)
TEST_F(Su2, NamesMarkersByPhysicalGroups) {
  const MeshFile file = read_mesh_file(fixture("groups.msh"));
  const std::string text = written(file);
  const MeshFile after = read_mesh_file(scratch_.path("out.su2"));
  std::size_t named = 0;
  for (const CellGroup& group : file.content()->groups) {
    if (group.dimension != 2) continue;
    ++named;
    EXPECT_EQ(find_node_set(after, group.name), find_node_set(file, group.name));
  }
  EXPECT_GT(named, 0U) << text;
}
#endif

TEST_F(Su2, CarriesASurfaceInItsPlaneOnly) {
  put_bytes(scratch_.path("a.obj"),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nl 1 2\n");
  MeshFile file = read_mesh_file(scratch_.path("a.obj"));
  EXPECT_EQ(written(file),
            "NDIME= 2\nNELEM= 2\n5 0 1 2\n5 1 3 2\nNPOIN= 4\n0 0\n1 0\n0 1\n1 1\nNMARK= 1\n"
            "MARKER_TAG= unnamed\nMARKER_ELEMS= 1\n3 0 1\n");

  positions_of(file)[3].z = 1;
  EXPECT_THAT(error_of([&] { static_cast<void>(written(file)); }).second,
              HasSubstr("node 3 is not in the plane z = 0"));
}

}  // namespace
}  // namespace meshsmooth::formats
