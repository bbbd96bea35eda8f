// Nastran decks: what is read. Coordinate systems and writing have files of their own.

#include <gmock/gmock.h>

#include <map>

#include "content.hpp"
#include "nastran_deck.hpp"

namespace meshsmooth::formats {
namespace {

using test::ids_of_set;
using test::kFan;
using test::kGrids;
using test::NastranTest;
using test::nodes_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class Nastran : public NastranTest {};

TEST_F(Nastran, ReadsSmallLargeAndFreeFieldsTabsAndSmallLetters) {
  const MeshFile file = read(
      "begin bulk\n"
      "grid    1               1.      2.      3.\n"
      "GRID*   2                               4.              5.              *A\n"
      "*A      6.\n"
      "GRID,3,,7.,8.,9.\n"
      "  Grid ,  4 , , 1.5-3 ,-.5+3, 7E-2\n"
      "GRID   *5                               1.5D3           -1.5D-3\n"
      "*       +.25\n"
      "GRID*,6,,1.d1,2.\n"
      "*,3.\n"
      "GRID\t7\t\t.5\t\t.25\n"
      "ctria3  1       1       1       2       3\n"
      "CQUAD4,2,1,4,5,6,7\n"
      "enddata\n");

  const auto& nodes = nodes_of(file);
  EXPECT_THAT(nodes,
              ElementsAre(Vec3d{1, 2, 3}, Vec3d{4, 5, 6}, Vec3d{7, 8, 9}, Vec3d{1.5e-3, -500, 0.07},
                          Vec3d{1500, -1.5e-3, 0.25}, Vec3d{10, 2, 3}, Vec3d{0.5, 0, 0.25}));
  ASSERT_EQ(file.mesh.blocks.size(), 2u);
  EXPECT_EQ(file.mesh.element_count(), 2u);
}

TEST_F(Nastran, TakesBlankCoordinatesForZero) {
  const MeshFile file = read(
      "GRID,1,\nGRID    2               1.\nGRID,3,,,1.\nGRID,4,,1.,1.,,,\nGRID,5\nGRID    6\n"
      "CQUAD4,1,,1,2,4,3\nCQUAD4,2,,5,2,4,3\nCTRIA3,3,,6,2,3\n");

  EXPECT_THAT(nodes_of(file), ElementsAre(Vec3d{0, 0, 0}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0},
                                          Vec3d{1, 1, 0}, Vec3d{0, 0, 0}, Vec3d{0, 0, 0}));
  EXPECT_THAT(file.content()->dataset->cell_column(kEntityArray)->values, ElementsAre(1, 2, 3))
      << "a property that is blank is the element's id";
}

TEST_F(Nastran, NeedsNoEnddataAndNoControl) {
  for (const std::string& text :
       {kGrids + "CTETRA,1,1,1,2,3,4\n",
        "SOL 101\nCEND\nBEGIN BULK\n" + kGrids + "CTETRA,1,1,1,2,3,4",
        "SOL 101\nCEND\nTITLE = GRID,CTETRA\n" + kGrids + "CTETRA,1,1,1,2,3,4\nendDATA\ngarbage\n",
        "ID A,B\nSOL 101\n  CEND\nSPC = 1\n  begin bulk\n" + kGrids + "CTETRA,1,1,1,2,3,4\n",
        "\xEF\xBB\xBF" + kGrids + "CTETRA,1,1,1,2,3,4\n"}) {
    EXPECT_EQ(read(text).mesh.element_count(), 1u) << text;
  }
}

TEST_F(Nastran, FindsContinuationsInEveryForm) {
  const std::string grids = test::ten_grids();
  for (const char* card :
       {"CTETRA,1,1,1,2,3,4,5,6\n$ mid-side nodes\n,7,8,9,10\n",
        "CTETRA,1,1,1,2,3,4,5,6,+A\n+A,7,8,9,10\n", "CTETRA,1,1,1,2,3,4,5,6,+A\n\n+,7,8,9,10\n",
        "CTETRA,1,1,1,2,3,4,5,6\n   ,7,8,9,10\n",
        "CTETRA* 1               1               1               2\n"
        "*       3               4               5               6\n"
        "*       7               8               9               10\n",
        "CTETRA  1       1       1       2       3       4       5       6       +A\n"
        "+A      7       8       9       10\n",
        "CTETRA  1       1       1       2       3       4       5       6       +\n"
        "$ a comment\n        7       8       9       10 $ another one\n",
        "CTETRA  1       1       1       2       3       4       5       6\n"
        "*A      7               8               9               10\n",
        "ctetra\t1\t1\t1\t2\t3\t4\t5\t6\n\t7\t8\t9\t10\n"}) {
    for (const bool crlf : {false, true}) {
      std::string text = grids + card;
      if (crlf) text = test::with_crlf(text);
      const MeshFile file = read(text);
      ASSERT_EQ(file.mesh.blocks.size(), 1u) << text;
      EXPECT_EQ(file.mesh.blocks[0].type, ElementType::tetrahedron10) << text;
      EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9)) << text;
    }
  }
}

TEST_F(Nastran, ReadsEverySurfaceAndVolumeCard) {
  const std::map<std::string, std::pair<int, std::string>> cards = {
      {"CTRIA3", {3, "triangle"}},   {"CTRIAR", {3, "triangle"}},
      {"CTRIA6", {6, "triangle6"}},  {"CTRIAX", {6, "triangle6"}},
      {"CTRIAX6", {6, "triangle6"}}, {"CQUAD4", {4, "quad"}},
      {"CQUADR", {4, "quad"}},       {"CSHEAR", {4, "quad"}},
      {"CQUAD8", {8, "quad8"}},      {"CQUAD", {9, "quad9"}},
      {"CQUADX", {9, "quad9"}},      {"CTETRA", {10, "tetrahedron10"}},
      {"CPYRAM", {13, "pyramid13"}}, {"CPYRA", {5, "pyramid"}},
      {"CPENTA", {15, "wedge15"}},   {"CHEXA", {20, "hexahedron20"}}};
  std::string grids;
  for (int node = 1; node <= 20; ++node) {
    grids += "GRID," + std::to_string(node) + ",," + std::to_string(node % 3) + ".," +
             std::to_string(node % 4) + ".," + std::to_string(node % 7) + ".\n";
  }
  for (const auto& [name, expected] : cards) {
    std::string card = name + ",1,1";
    for (int node = 1; node <= expected.first; ++node) {
      card += (node == 7 || node == 15 ? "\n," : ",") + std::to_string(node);
    }
    const MeshFile file = read(grids + card + "\n");
    EXPECT_EQ(element_name(file.mesh.blocks.at(0).type), expected.second) << name;
  }
}

// pyNastran #51, #140: 1 of 162 elements was read.
TEST_F(Nastran, HoldsElementsWithSomeOfTheirNodesInTheMiddle) {
  const MeshFile file =
      read(test::ten_grids() + "GRID,11,,0.,0.,-1.\n" + "CTETRA,1,1,1,2,3,4,5,6\n,,8,9,10\n" +
           "CTETRA,2,1,1,2,4,11,5,9\n,8,7,6,10\n" + "CTETRA,3,1,1,2,4,3,5,9\n,8,7,6,10\n");

  EXPECT_EQ(file.mesh.element_count(), 2u);
  ASSERT_THAT(file.held_cells(), SizeIs(1));
  EXPECT_EQ(file.held_cells()[0].name, "CTETRA with 9 of 10 nodes");
  EXPECT_EQ(file.held_cells()[0].count, 1);
  EXPECT_EQ(file.mesh.fixed.at(0), 1);
  EXPECT_EQ(file.mesh.fixed.at(10), 0);
}

// Gmsh writes bricks with 27 nodes.
TEST_F(Nastran, HoldsSolidsWithMoreNodesThanNastranHas) {
  const MeshFile file =
      read(test::ten_grids() + "GRID,11,,0.,0.,-1.\n" +
           "CTETRA,1,1,1,2,3,4,5,6\n,7,8,9,10,11\nCTRIA3,2,1,1,2,3\n" + "CTETRA,3,1,1,2,3,4\n");
  EXPECT_EQ(file.mesh.element_count(), 1u);
  ASSERT_THAT(file.held_cells(), SizeIs(1));
  EXPECT_EQ(file.held_cells()[0].name, "CTETRA with 11 nodes");
}

TEST_F(Nastran, TakesElementsWithoutNodesInTheMiddleForLinear) {
  const MeshFile file =
      read(test::ten_grids() +
           "CQUAD8,1,1,1,2,3,4\n,,,.1,.1\nCTRIA6  2       1       1       2       3\n"
           "CQUAD,3,1,1,2,3,4,5,6\n,7,8\n");
  ASSERT_EQ(file.mesh.blocks.size(), 3u);
  EXPECT_EQ(file.mesh.blocks[0].type, ElementType::quad);
  EXPECT_EQ(file.mesh.blocks[1].type, ElementType::triangle);
  EXPECT_EQ(file.mesh.blocks[2].type, ElementType::quad8);
}

// Both kinds had been dropped without a word.
TEST_F(Nastran, KeepsTwoOrdersOfOneProperty) {
  const MeshFile file = read(test::ten_grids() +
                             "CQUAD4,1,1,1,2,3,4\nCQUAD8,2,1,1,2,3,4,5,6\n,7,8\n"
                             "CTRIA3,3,1,1,2,3\nCTRIAR,4,1,1,2,3\n");
  EXPECT_EQ(file.mesh.element_count(), 4u);
}

TEST_F(Nastran, CountsWhatIsAttachedToNodesAsLowerDimensional) {
  const MeshFile file =
      read("SPOINT,90,THRU,92\nEPOINT,93\n" + kFan +
           "CBAR,11,1,1,2,0.,0.,1.\nCBEAM,12,1,2,3,0.,0.,1.\nCROD,13,1,3,4\nCONROD,14,1,5,1\n"
           "RBE2,15,5,123456,1,2\nRBE3,16,,5,123456,1.,123,1,2\n,3\nCONM2,17,4,,1.5\n"
           "PLOTEL,18,1,5\nCELAS1,19,1,5,1\nCELAS2,20,1.+6,5,1,90,\nCBUSH,21,9,1,2,,,,0\n"
           "CGAP,22,1,1,5\nCMASS2,23,1.,3,1\nSPC,1,4,123456,0.\nFORCE,1,3,,10.,0.,0.,1.\n"
           "PSHELL,1,1,.1\nMAT1,1,2.1+11,,.3\n");

  EXPECT_EQ(file.mesh.node_count(), 5u);
  EXPECT_EQ(file.mesh.element_count(), 4u);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 13);
  EXPECT_THAT(file.held_cells(), SizeIs(0));
  EXPECT_EQ(file.lower_dimensional_nodes().size(), 5u);
}

TEST_F(Nastran, HoldsElementsThatNobodyHereKnows) {
  const MeshFile file =
      read(kFan + "CNEWEL,21,1,1,2,5\nCHEXCZ,22,1,1,2,3,4,5\nCSPOT,1,2,3\nCYAX,1,2\n");

  ASSERT_THAT(file.held_cells(), SizeIs(2));
  EXPECT_EQ(file.held_cells()[0].name, "CNEWEL");
  EXPECT_EQ(file.held_cells()[1].name, "CHEXCZ");
  EXPECT_EQ(file.mesh.fixed.at(4), 1);
}

TEST_F(Nastran, AcceptsAGridAgainOnlyWhereItSaysTheSame) {
  const MeshFile file = read("GRID,1\n" + kFan + "GRID,5,,.31,.64,.1,,\n");
  EXPECT_EQ(file.mesh.node_count(), 5u);
  const auto [reason, text] = error(kFan + "GRID,5,,.32,.64,.1\n");
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text,
              HasSubstr("line 10: GRID 5 is there again with other coordinates, first in line 5"));
}

TEST_F(Nastran, TakesNamesOfPropertiesFromCommentsOfPreprocessors) {
  const MeshFile file = read(
      "SOL 101\nCEND\nSET 5 = 1, 2 THRU 4,\n 90, EXCEPT 3\nSET 6 = ALL\nSET 7 = 1.5, 2.5\nBEGIN "
      "BULK\n"
      "$HMNAME PROP                   1\"roof\" 4\n"
      "$ANSA_NAME_COMMENT;2;PSHELL;floor;NO;\n"
      "$ Femap with NX Nastran Property 3 : left wall\n"
      "$ Elements and Element Properties for region : right\nPSHELL,4,8,.1\nPSHELL,1,9,.1\n" +
      test::fan_of_properties() + "SET1,8,1,THRU,3\nSET3,9,ELEM,1\nSET3,10,GRID,4,5\n");

  EXPECT_EQ(ids_of_set(file, "roof"), (std::vector<std::int64_t>{1, 2, 5}));
  EXPECT_EQ(ids_of_set(file, "floor"), (std::vector<std::int64_t>{2, 3, 5}));
  EXPECT_EQ(ids_of_set(file, "left wall"), (std::vector<std::int64_t>{3, 4, 5}));
  EXPECT_EQ(ids_of_set(file, "right"), (std::vector<std::int64_t>{1, 4, 5}));
  EXPECT_EQ(ids_of_set(file, "SET 5"), (std::vector<std::int64_t>{1, 2, 4}));
  EXPECT_EQ(ids_of_set(file, "SET 6"), (std::vector<std::int64_t>{1, 2, 3, 4, 5}));
  EXPECT_EQ(ids_of_set(file, "SET1 8"), (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_EQ(ids_of_set(file, "SET3 9"), (std::vector<std::int64_t>{1, 2, 5}));
  EXPECT_EQ(ids_of_set(file, "SET3 10"), (std::vector<std::int64_t>{4, 5}));
  EXPECT_EQ(find_regions(file).of_element, (std::vector<std::int32_t>{0, 1, 2, 3}));
  EXPECT_EQ(find_regions(file, "nastran:material").of_element,
            (std::vector<std::int32_t>{2, 0, 0, 1}));
}

TEST_F(Nastran, TakesComponentsAndSetsFromHyperMesh) {
  const MeshFile file = read(
      "$HMSET        5        2 \"two of them\"\nSET 5 = 1 THRU 2\nBEGIN BULK\n"
      "$HMNAME COMP                   7\"half\"\n$HMMOVE        7\n$              3THRU           "
      "4\n" +
      kFan);
  EXPECT_EQ(ids_of_set(file, "two of them"), (std::vector<std::int64_t>{1, 2, 3, 5}));
  EXPECT_EQ(ids_of_set(file, "half"), (std::vector<std::int64_t>{1, 3, 4, 5}));
}

TEST_F(Nastran, SuperelementsHaveIdsOfTheirOwn) {
  const MeshFile file = read("BEGIN BULK\n" + kFan + "BEGIN SUPER=1\n" + kFan + "ENDDATA\n");
  EXPECT_EQ(file.mesh.node_count(), 10u);
  EXPECT_EQ(file.mesh.element_count(), 8u);
}

TEST_F(Nastran, FollowsIncludesOverLinesAndLevels) {
  std::filesystem::create_directories(scratch_.path("parts/deep"));
  test::put_bytes(scratch_.path("parts/grids.dat"),
                  "$ grids\ninclude 'deep/\n more.dat'\n" + kGrids);
  test::put_bytes(scratch_.path("parts/deep/more.dat"), "CTETRA,1,1,1,2,3,4\n");
  EXPECT_EQ(read("BEGIN BULK\n  INCLUDE\n 'parts\\grids.dat' $ all\n").mesh.element_count(), 1u);
}

TEST_F(Nastran, SaysWhichIncludedFileIsNotThere) {
  auto [reason, text] = error("BEGIN BULK\n$\nINCLUDE 'gone.dat'\n" + kFan);
  EXPECT_EQ(reason, "FILE_NOT_FOUND");
  EXPECT_THAT(text, HasSubstr("in.bdf: line 3: there is no file \"gone.dat\" to include"));
  std::tie(reason, text) = error("BEGIN BULK\nINCLUDE 'in.bdf'\n" + kFan);
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, HasSubstr("line 2: \"in.bdf\" includes itself"));
}

TEST_F(Nastran, RefusesEnddataInAnIncludedFileThatWouldHideCards) {
  test::put_bytes(scratch_.path("grids.dat"), kGrids + "ENDDATA\n");
  const auto [reason, text] =
      error("BEGIN BULK\nINCLUDE 'grids.dat'\nCTETRA,1,1,1,2,3,4\nENDDATA\n");
  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, AllOf(HasSubstr("grids.dat: line 5"), HasSubstr("take it out")));
}

// A tab goes on by eight columns there, as an editor shows it, so a field would be left out.
TEST_F(Nastran, TakesTabsForSeparatorsWhereFieldsThatFillTheirColumnsMakeNoSense) {
  const std::string text =
      "GRID\t1\t\t0.333333\t0.\t0.\nGRID\t2\t\t0.333333\t0.666667\t0.333333\n"
      "GRID\t3\t\t0.\t0.333333\t0.\nGRID\t4\t\t0.333333\t\t0.5\n"
      "GRID\t12345678\t\t0.\t0.\t1.\nCTRIA3\t1\t1\t12345678\t2\t3\nCTRIA3\t2\t1\t1\t2\t4\n";
  MeshFile file = read(text);
  EXPECT_THAT(nodes_of(file),
              ElementsAre(Vec3d{0.333333, 0, 0}, Vec3d{0.333333, 0.666667, 0.333333},
                          Vec3d{0, 0.333333, 0}, Vec3d{0.333333, 0, 0.5}, Vec3d{0, 0, 1}));
  for (Vec3d& node : test::positions_of(file)) node += {1.0 / 3, 1.0 / 7, 1.0 / 9};
  const MeshFile again = read(written(file));
  for (std::size_t node = 0; node < 5; ++node) {
    EXPECT_NEAR(nodes_of(again)[node].x, nodes_of(file)[node].x, 1e-6);
    EXPECT_NEAR(nodes_of(again)[node].y, nodes_of(file)[node].y, 1e-6);
    EXPECT_NEAR(nodes_of(again)[node].z, nodes_of(file)[node].z, 1e-6);
  }
}

}  // namespace
}  // namespace meshsmooth::formats
