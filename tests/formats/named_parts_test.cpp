// Regions of elements and sets of nodes by the names that files give them.

#include <gmock/gmock.h>

#include "node_sets.hpp"
#include "regions.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::error_of;
using test::fixture;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Two tetrahedra on a common face, a triangle of it in between; `data` hangs on them.
std::string vtk_text(const std::string& data) {
  return "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\n"
         "POINTS 5 double\n0 0 0  1 0 0  0 1 0  0 0 1  1 1 1\n"
         "CELLS 3 14\n4 0 1 2 3\n3 1 2 3\n4 1 4 2 3\nCELL_TYPES 3\n10\n5\n10\n" +
         data;
}

std::string cell_array(const std::string& name, const std::string& type,
                       const std::string& values) {
  return "SCALARS " + name + " " + type + " 1\nLOOKUP_TABLE default\n" + values + "\n";
}

class NamedParts : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& name, const std::string& text) const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] MeshFile read_vtk(const std::string& data) const {
    return read("in.vtk", vtk_text(data));
  }
  /// The same file, written in another format and read again.
  [[nodiscard]] MeshFile converted(const MeshFile& file, const std::string& name) const {
    write_mesh_file(scratch_.path(name), file);
    return read_mesh_file(scratch_.path(name));
  }

  const Scratch scratch_;
};

TEST_F(NamedParts, RegionsAreThoseOfTheArrayNamed) {
  const MeshFile file = read_vtk("CELL_DATA 3\n" + cell_array("part", "int", "9 5 -7") +
                                 cell_array("real", "double", "1 2.5 3"));

  const Regions part = find_regions(file, "part");
  EXPECT_EQ(part.array, "part");
  EXPECT_EQ(part.count, 2U);
  EXPECT_THAT(part.of_element, ElementsAre(1, 0));
  EXPECT_THAT(find_regions(file, "real").of_element, ElementsAre(0, 1)) << "the triangle's is odd";
  EXPECT_TRUE(find_regions(file).array.empty()) << "nobody said that these are regions";
}

TEST_F(NamedParts, OneRegionIsNone) {
  const Regions regions =
      find_regions(read_vtk("CELL_DATA 3\n" + cell_array("part", "int", "4 5 4")), "part");

  EXPECT_EQ(regions.count, 1U);
  EXPECT_THAT(regions.of_element, IsEmpty());
}

TEST_F(NamedParts, AnArrayThatTellsNoRegionsIsRefused) {
  const MeshFile file = read_vtk("CELL_DATA 3\n" + cell_array("part", "int", "4 5 4") +
                                 cell_array("stress", "double", "1 1 2.5") +
                                 "VECTORS flow double\n0 0 0 1 1 1 2 2 2\n");

  const auto [reason, text] = error_of([&] { (void)find_regions(file, "stress"); });
  EXPECT_EQ(reason, "ARRAY_NOT_WHOLE");
  EXPECT_THAT(text, HasSubstr("\"stress\" cannot be used as element regions: element 2 has 2.5"));
  for (const char* name : {"flow", "nothing"}) {
    const auto [unknown, list] = error_of([&] { (void)find_regions(file, name); });
    EXPECT_EQ(unknown, "NAME_UNKNOWN");
    EXPECT_THAT(list, HasSubstr("\"" + std::string(name) + "\"; there are: part, stress"));
  }
}

TEST_F(NamedParts, ArraysOfConvertersAreTakenByDefaultUnlessAllZero) {
  const MeshFile file = read_vtk("CELL_DATA 3\n" + cell_array("gmsh:geometrical", "int", "1 1 2") +
                                 cell_array("medit:ref", "int", "3 0 4") +
                                 cell_array("gmsh:physical", "int", "0 7 0"));

  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "medit:ref");
  EXPECT_THAT(regions.of_element, ElementsAre(0, 1));
}

TEST_F(NamedParts, SetsAreWhereAPointArrayIsNotZero) {
  const MeshFile file = read_vtk("POINT_DATA 5\n" + cell_array("held", "int", "0 1 0 -2 0") +
                                 cell_array("weight", "double", "0 0 0.5 0 0") +
                                 "VECTORS flow double\n0 0 0 1 1 1 2 2 2 3 3 3 4 4 4\n");

  EXPECT_THAT(find_node_set(file, "held"), ElementsAre(1, 3));
  EXPECT_THAT(find_node_set(file, "weight"), ElementsAre(2));
  const auto [reason, text] = error_of([&] { (void)find_node_set(file, "flow"); });
  EXPECT_EQ(reason, "NAME_UNKNOWN");
  EXPECT_THAT(text, HasSubstr("\"flow\"; there are: held, weight"));
  EXPECT_THAT(error_of([&] { (void)find_node_set(read_vtk(""), "held"); }).second,
              HasSubstr("there is none"));
}

TEST_F(NamedParts, TetGensAttributesAreRegionsAndItsMarkersASet) {
  const MeshFile file = read_mesh_file(fixture("tetgen.node"));

  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "tetgen:attribute_0");
  EXPECT_EQ(regions.count, 2U);
  EXPECT_THAT(regions.of_element, ElementsAre(1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0));
  EXPECT_THAT(find_node_set(file, "tetgen:marker"), ElementsAre(0, 1, 3, 4, 6, 7));
}

#if defined(MESHSMOOTH_WITH_GMSH)
TEST_F(NamedParts, PhysicalGroupsAreSetsInMshAndInWhatItIsConvertedTo) {
  const MeshFile msh = read_mesh_file(fixture("groups.msh"));
  for (const MeshFile& file : {msh, converted(msh, "out.vtu")}) {
    EXPECT_THAT(find_node_set(file, "wall"), ElementsAre(0, 1, 2));
    EXPECT_THAT(find_node_set(file, "rock"), ElementsAre(0, 1, 2, 3, 4));
    EXPECT_THAT(find_node_set(file, "temp"), ElementsAre(0, 1)) << "of nodes without a value";
    EXPECT_THAT(error_of([&] { (void)find_node_set(file, "9"); }).second,
                HasSubstr("\"9\"; there are: wall, rock, temp"));
  }
}

TEST_F(NamedParts, ElementsOfOnePhysicalGroupAreOneRegion) {
  const MeshFile msh = read_mesh_file(fixture("groups.msh"));
  for (const MeshFile& file : {msh, converted(msh, "out.vtu")}) {
    EXPECT_EQ(find_regions(file).array, "gmsh:physical");
    EXPECT_EQ(find_regions(file).count, 1U);
    EXPECT_THAT(find_regions(file, "gmsh:geometrical").of_element, ElementsAre(0, 1));
  }
}

/// Two volumes; `volumes` says how many physical groups each is in, and which.
std::string msh_text(const std::string& names, const std::string& first_volume,
                     const std::string& second_volume) {
  return "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + names +
         "$Entities\n0 0 1 2\n1 0 0 0 1 1 1 1 5 0\n1 0 0 0 1 1 1 " + first_volume +
         " 0\n2 0 0 0 1 1 1 " + second_volume +
         " 0\n$EndEntities\n"
         "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
         "$Elements\n3 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 1\n2 1 2 3 4\n3 2 4 1\n3 2 5 3 4\n"
         "$EndElements\n";
}

TEST_F(NamedParts, VolumesThatShareAGroupButNotAllAreDifferentRegions) {
  const MeshFile file =
      read("in.msh", msh_text("$PhysicalNames\n2\n3 1 \"all\"\n3 2 \"rock\"\n$EndPhysicalNames\n",
                              "2 1 2", "2 1 3"));

  EXPECT_EQ(find_regions(file).array, "gmsh:physical");
  EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 1));
  EXPECT_THAT(find_regions(file, "gmsh:physical").of_element, ElementsAre(0, 1));
  EXPECT_THAT(find_node_set(file, "all"), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(find_node_set(file, "rock"), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(find_node_set(file, "3"), ElementsAre(1, 2, 3, 4)) << "it has no name";
  EXPECT_THAT(find_node_set(file, "5"), ElementsAre(0, 1, 2)) << "a surface without a name";
}

TEST_F(NamedParts, VolumesInNoGroupAreRegionsByTheirEntities) {
  const MeshFile file = read("in.msh", msh_text("", "0", "0"));

  EXPECT_EQ(find_regions(file).array, "gmsh:geometrical");
  EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 1));
}

TEST_F(NamedParts, MeditsReferencesAreRegions) {
  const MeshFile file =
      read("in.mesh",
           "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n"
           "0 1 0 0\n0 0 1 0\n1 1 1 0\nTetrahedra\n2\n1 2 3 4 8\n2 5 3 4 6\nEnd\n");

  EXPECT_EQ(find_regions(file).array, "medit:ref");
  // Gmsh gives a file's elements group by group.
  EXPECT_EQ(find_regions(file).count, 2U);
}
#endif

}  // namespace
}  // namespace meshsmooth::formats
