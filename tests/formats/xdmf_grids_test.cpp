// XDMF files with several grids, by numbers in their text.

#include <gmock/gmock.h>

#include "mesh_file.hpp"
#include "node_sets.hpp"
#include "regions.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// A grid of triangles round a node, by numbers in the text.
std::string grid(const std::string& name, const std::string& middle, double x = 0) {
  const std::string left = std::to_string(x), right = std::to_string(x + 1);
  return R"(<Grid Name=")" + name + R"("><Topology TopologyType="Triangle" NumberOfElements="4">
<DataItem DataType="Int" Dimensions="4 3">0 1 4  1 2 4  2 3 4  3 0 4</DataItem></Topology>
<Geometry GeometryType="XY"><!-- <DataItem> --><DataItem Dimensions="5 2" Name="a > b">)" +
         left + " 0 " + right + " 0 " + right + " 1 " + left + " 1 " + middle +
         R"(</DataItem></Geometry>
<Attribute Name="part" Center="Cell"><DataItem DataType="Int">1 1 2 2</DataItem></Attribute></Grid>
)";
}

std::string in_domain(const std::string& text) {
  return "<Xdmf xmlns:xi=\"http://www.w3.org/2001/XInclude\"><Domain>" + text +
         "</Domain></Xdmf>\n";
}

std::string collection(const std::string& type, const std::string& grids) {
  return "<Grid GridType=\"Collection\" Name=\"all\" CollectionType=\"" + type + "\">" + grids +
         "</Grid>";
}

class XdmfGrids : public ::testing::Test {
 protected:
  MeshFile read(const std::string& domain) {
    put_bytes(path_, in_domain(domain));
    return read_mesh_file(path_);
  }
  std::string error(const std::string& domain) {
    return error_of([&] { (void)read(domain); }).second;
  }

  const Scratch scratch_;
  const std::filesystem::path path_ = scratch_.path("a.xdmf");
};

TEST_F(XdmfGrids, OfASpatialCollectionAreOneMeshWithItsNodesApart) {
  MeshFile file = read(collection("Spatial", grid("a", "0.3 0.4") + grid("b", "5.3 0.4", 5)));
  EXPECT_EQ(file.mesh.node_count(), 10U);
  EXPECT_EQ(file.mesh.element_count(), 8U);
  EXPECT_EQ(find_regions(file, "xdmf:grid").count, 2U);
  EXPECT_EQ(find_regions(file, "part").count, 2U);
  EXPECT_THAT(find_node_set(file, "b"), ElementsAre(5, 6, 7, 8, 9));
  std::get<std::vector<Vec3d>>(file.mesh.positions)[9] = {5.5, 0.5, 0};

  write_mesh_file(path_, file);

  const std::string text = bytes_of(path_);
  EXPECT_THAT(text, HasSubstr(" 0.3 0.4</DataItem>"));
  EXPECT_THAT(text, HasSubstr(" 5.5 0.5</DataItem>"));
}

TEST_F(XdmfGrids, OfATimeSeriesAreOneMeshByIncludesReferencesAndCopies) {
  const std::string included =
      "<Grid Name=\"b\"><xi:include xpointer=\"xpointer(//Grid[@Name=&quot;all&quot;]/Grid[1]/"
      "*[self::Topology or self::Geometry])\"/><Time Value=\"1\"/></Grid>";
  const std::string referring =
      "<Grid Name=\"c\"><Topology Reference=\"XML\">//Grid[@Name='a'][1]/Topology</Topology>"
      "<Geometry Reference=\"//Grid[@Name='a'][1]/Geometry\"/></Grid>";
  MeshFile file = read(
      collection("Temporal", grid("a", "0.3 0.4") + included + grid("d", "0.3 0.4") + referring));
  EXPECT_EQ(file.mesh.node_count(), 5U);
  EXPECT_EQ(file.mesh.element_count(), 4U);
  std::get<std::vector<Vec3d>>(file.mesh.positions)[4] = {0.5, 0.5, 0};

  write_mesh_file(path_, file);

  const std::string text = bytes_of(path_);
  EXPECT_EQ(text.find("0.3 0.4"), std::string::npos) << "the copy changes, too";
  EXPECT_TRUE(read_mesh_file(path_).mesh.positions == file.mesh.positions);
}

TEST_F(XdmfGrids, AreRefusedWhereTheMeshChangesWithTime) {
  const std::string first = grid("a", "0.3 0.4");
  EXPECT_THAT(error(collection("Temporal", first + grid("b", "0.3 0.5"))),
              HasSubstr("has its nodes elsewhere at a later time step"));
  const std::string other = replaced(grid("b", "0.3 0.4"), "0 1 4", "0 1 2");
  EXPECT_THAT(error(collection("Temporal", first + other)),
              HasSubstr("has other elements at a later time step"));
  EXPECT_THAT(error(collection("Temporal", first + collection("Spatial", first + first))),
              HasSubstr("have 1 and 2 grids"));
}

TEST_F(XdmfGrids, AreRefusedWhereACountIsWrong) {
  const std::string good = grid("a", "0.3 0.4");
  EXPECT_THAT(error(replaced(good, "NumberOfElements=\"4\"", "Dimensions=\"5\"")),
              HasSubstr("has 4 elements, not 5"));
  EXPECT_THAT(error(replaced(good, "Dimensions=\"5 2\"", "Dimensions=\"6 2\"")),
              HasSubstr("with Dimensions=\"6 2\" has 10 numbers"));
  EXPECT_THAT(error(replaced(good, "0 1 4", "0 1 9")), HasSubstr("uses node 9, there are only 5"));
  EXPECT_THAT(error("<Grid><xi:include href=\"b.xdmf\"/></Grid>" + good),
              HasSubstr("includes the file \"b.xdmf\""));
}

TEST_F(XdmfGrids, HoldPolygonsAndPolyhedra) {
  const MeshFile file = read(R"(<Grid><Geometry><DataItem>0 0 0 1 0 0 1 1 0 0 1 0
0 0 1 1 0 1 1 1 1 0 1 1  0.5 0.5 2</DataItem></Geometry><Topology TopologyType="Mixed"
NumberOfElements="4"><DataItem DataType="Int">9 0 1 2 3 4 5 6 7
16 5  4 4 5 6 7  3 4 5 8  3 5 6 8  3 6 7 8  3 7 4 8
3 5 0 1 2 6 3  2 3 0 1 2</DataItem></Topology></Grid>)");
  EXPECT_EQ(file.mesh.element_count(), 1U);
  ASSERT_EQ(file.held_cells().size(), 1U);
  EXPECT_EQ(file.held_cells()[0].name, "polyhedron");
  EXPECT_THAT(file.mesh.fixed, ElementsAre(0, 0, 0, 0, 1, 1, 1, 1, 1));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
}

}  // namespace
}  // namespace meshsmooth::formats
