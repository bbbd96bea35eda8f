// OBJ and PLY files of every habit.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SurfaceText : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& name, const std::string& text) const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::string written(const std::string& name, const MeshFile& file) const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }
  [[nodiscard]] std::string error(const std::string& name, const std::string& text) const {
    return error_of([&] { static_cast<void>(read(name, text)); }).second;
  }

  const Scratch scratch_;
};

/// Eight nodes in a plane: a pentagon, a hexagon and two triangles.
const std::string kPlaces = "0 0 0\n1 0 0\n1 1 0\n.5 1.5 0\n0 1 0\n2 0 0\n2 1 0\n1.5 2 0\n";

std::string vertices() {
  std::string text;
  for (const std::string& line : test::lines_of(kPlaces)) text += "v " + line + '\n';
  return text;
}

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    "property float z\n";

void expect_polygons(const MeshFile& file) {
  EXPECT_EQ(file.mesh.element_count(), 2U);
  ASSERT_EQ(file.held_cells().size(), 1U);
  EXPECT_EQ(file.held_cells()[0].name, "polygon");
  EXPECT_EQ(file.held_cells()[0].count, 2);
  EXPECT_THAT(file.mesh.fixed, ElementsAre(1, 1, 1, 1, 1, 1, 1, 1));
}

TEST_F(SurfaceText, PolygonsOfAnObjFileHoldTheirNodes) {
  const std::string text =
      vertices() + "f 1 2 3 4 5\nf 2 6 7 8 4 3\nf 1/1 2//1 5/1/1\nf -4 -8 -7\n";
  MeshFile file = read("a.obj", text);

  expect_polygons(file);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 4, 4, 0, 1));
  EXPECT_EQ(written("b.obj", file), text);
  positions_of(file)[7].y = 2.5;
  EXPECT_THAT(changed_lines(text, written("b.obj", file)), ElementsAre("v 1.5 2.5 0"));
}

TEST_F(SurfaceText, PolygonsOfAPlyFileHoldTheirNodes) {
  const std::string text = kPly +
                           "element face 4\nproperty list uchar int vertex_index\nend_header\n" +
                           kPlaces + "5 0 1 2 3 4\n6 1 5 6 7 3 2\n3 0 1 4\n3 4 0 1\n";
  const MeshFile file = read("a.ply", text);

  expect_polygons(file);
  EXPECT_EQ(written("b.ply", file), text);
  EXPECT_THAT(file.notes(), IsEmpty());
}

TEST_F(SurfaceText, PolygonsTravelBetweenObjAndPly) {
  const std::string text = vertices() + "f 1 2 3 4 5\nf 2 6 7 8 4 3\nf 1 2 5\nf 5 1 2\n";
  (void)written("b.ply", read("a.obj", text));
  const MeshFile ply = read_mesh_file(scratch_.path("b.ply"));
  expect_polygons(ply);
  (void)written("c.obj", ply);
  expect_polygons(read_mesh_file(scratch_.path("c.obj")));

  for (const char* name : {"d.node", "d.su2"}) {
    EXPECT_EQ(error_of([&] { (void)written(name, ply); }).first, "ELEMENT_NOT_SUPPORTED") << name;
  }
}

TEST_F(SurfaceText, AHeldElementOfADeckIsNotLostInAnotherFormat) {
  const MeshFile file = read("a.inp",
                             "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"
                             "*ELEMENT, TYPE=D\n2,1,2,3\n");
  for (const char* name : {"b.obj", "b.ply", "b.su2", "b.node"}) {
    const auto [reason, text] = error_of([&] { (void)written(name, file); });
    EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED") << name;
  }
  EXPECT_THAT(error_of([&] { (void)written("b.ply", file); }).second,
              HasSubstr("cannot carry the 1 cells of the type D"));
}

TEST_F(SurfaceText, LinesOfAnObjFileMayContinue) {
  const std::string text =
      "\xEF\xBB\xBFv 0 \\\n0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 1.0\nf 1 2 \\\n3\nl 1 2\\\n 3\np 1 3\n"
      "g a \\\nf 9 9 9\nsurf 0 1 \\\n f 8 8 8\nfo 3 2 1\n";
  const MeshFile file = read("a.obj", text);

  EXPECT_EQ(file.mesh.node_count(), 3U);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 2, 1, 0));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_THAT(file.notes(), ElementsAre("free-form geometry (surf) does not move with the nodes"));
  EXPECT_EQ(written("b.obj", file), text);
}

TEST_F(SurfaceText, AnObjFileCarriesPointsAndLines) {
  const MeshFile file = read("a.inp",
                             "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"
                             "*ELEMENT, TYPE=B31\n2,1,2\n*ELEMENT, TYPE=MASS\n3,3\n"
                             "*ELEMENT, TYPE=B32\n4,1,2,3\n");
  EXPECT_EQ(written("b.obj", file), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\np 3\nl 1 2 3\n");
}

TEST_F(SurfaceText, SaysWhatIsWrongWithAnObjFileAndWhere) {
  EXPECT_THAT(error("a.obj", vertices() + "f 1 2\n"),
              HasSubstr("line 9: expected 3 nodes or more after f, found \"2\""));
  EXPECT_THAT(error("a.obj", vertices() + "l 1\n"), HasSubstr("expected 2 nodes or more after l"));
  EXPECT_THAT(error("a.obj", vertices() + "f 1 2 0\n"), HasSubstr("expected a node number"));
  EXPECT_THAT(error("a.obj", vertices() + "f 1 2 -9\n"), HasSubstr("expected a node number"));
  EXPECT_THAT(error("a.obj", "v 0 0\nv 1 0 0\n"), HasSubstr("line 1: expected a number"));
}

TEST_F(SurfaceText, ReadsStripsOfAPlyFileAsTriangles) {
  const std::string text = kPly +
                           "element tristrips 1\nproperty list int int vertex_indices\n"
                           "end_header\n" +
                           kPlaces + "11 0 1 4 2 -1 1 5 6 6 7 3\n";
  const MeshFile file = read("a.ply", text);

  ASSERT_EQ(file.mesh.blocks.size(), 1U);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 4, 4, 1, 2, 1, 5, 6, 7, 6, 3));
  EXPECT_EQ(written("b.ply", file), text);
}

TEST_F(SurfaceText, KeepsWhatAPlyFileHasBesides) {
  const std::string text =
      "ply\nformat ascii 1.0\ncomment by hand\nCreated by a program\nelement camera 1\n"
      "property float f\nproperty list uchar int modes\nelement vertex 3\nproperty double x\n"
      "property list uchar int of\nproperty double y\nproperty double z\nproperty uchar red\n"
      "element face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\n"
      "property list uchar float texcoord\nelement edge 1\nproperty int vertex1\n"
      "property int vertex2\nend_header\n1.5 2 3 4\n0 1 7 0 0 255\n1 0 0 0 255\n0 2 7 8 1 0 255\n"
      "1 3 0 1 2 2 .5 .5\n0 1\n";
  MeshFile file = read("a.ply", text);

  EXPECT_EQ(file.mesh.node_count(), 3U);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2));
  EXPECT_THAT(file.content()->dataset->node_column("red")->values, ElementsAre(255, 255, 255));
  EXPECT_THAT(file.notes(),
              ElementsAre("the line of the header that starts with \"Created\" is ignored"));
  EXPECT_EQ(written("b.ply", file), text);
  positions_of(file)[2].y = 1.25;
  EXPECT_THAT(changed_lines(text, written("b.ply", file)), ElementsAre("0 2 7 8 1.25 0 255"));
}

TEST_F(SurfaceText, NotesWhatAPlyFileDoesNotAnnounce) {
  const std::string head = kPly + "element face 1\nproperty list uchar int vertex_indices\n";
  MeshFile file = read("a.ply", head + "end_header\n" + kPlaces + "3 0 1 4\n3 1 2 4\n");
  EXPECT_THAT(file.notes(),
              ElementsAre("8 bytes after the last row that the header announces are ignored"));

  file = read("a.ply", head + "end_header\n0 0 0 9\n" + kPlaces.substr(6) + "3 0 1 4 2\n\n");
  EXPECT_EQ(std::get<std::vector<Vec3f>>(file.mesh.positions)[1], (Vec3f{1, 0, 0}));
  EXPECT_THAT(file.notes(),
              ElementsAre("vertex 0 has more numbers than the header announces, which are ignored "
                          "(and 1 more)"));
}

TEST_F(SurfaceText, SaysWhatIsWrongWithAPlyFile) {
  EXPECT_THAT(
      error("a.ply", kPly + "element face 1\nproperty list uchar int corners\nend_header\n" +
                         kPlaces + "3 0 1 2\n"),
      HasSubstr("its element face has no list vertex_indices or vertex_index"));
  EXPECT_THAT(error("a.ply", kPly +
                                 "element face 2\nproperty list uchar int vertex_indices\n"
                                 "end_header\n" +
                                 kPlaces + "3 0 1 2\n"),
              HasSubstr("the file ends too early"));
}

}  // namespace
}  // namespace meshsmooth::formats
