// Nastran decks: what is written, and coordinate systems.

#include <gmock/gmock.h>

#include <cmath>

#include "nastran/coordinate_systems.hpp"
#include "nastran/numbers.hpp"
#include "nastran_deck.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::kFan;
using test::kGrids;
using test::NastranTest;
using test::nodes_of;
using test::positions_of;
using test::put_bytes;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(NastranNumbers, AreRoundedToTheirColumns) {
  EXPECT_EQ(format_nastran_real(1.0 / 3, 8), ".3333333");
  EXPECT_EQ(format_nastran_real(-1.0 / 3, 8), "-.333333");
  EXPECT_EQ(format_nastran_real(7.5811189269110563e-6, 8), "7.5811-6");
  EXPECT_EQ(format_nastran_real(-1234567.0, 8), "-1.235+6") << "-1234567. needs nine";
  EXPECT_EQ(format_nastran_real(1234567.0, 8), "1234567.");
  EXPECT_EQ(format_nastran_real(0.000123456789, 8), "1.2346-4");
  EXPECT_EQ(format_nastran_real(99999999.9, 8), "1.+8");
}

TEST(NastranNumbers, StayNumbersAndFitInAnyColumns) {
  double value = 1.2345678901234567;
  for (int step = 0; step < 2000; ++step) {
    value *= step % 2 == 0 ? -7.123 : 1 / 6.0001;
    const double large = value * std::pow(10, step % 600 - 300);
    for (const std::size_t columns : {7, 8, 15, 16, 24}) {
      for (const double number : {value, large, std::round(value * 1000), -1 / value}) {
        if (!std::isfinite(number) || std::abs(number) < 1e-300) continue;
        const std::string text = format_nastran_real(number, columns);
        ASSERT_LE(text.size(), columns) << number;
        ASSERT_NE(text.find('.'), std::string::npos) << text;
        const auto read = parse_nastran_real(text);
        ASSERT_TRUE(read) << text;
        const auto digits = static_cast<double>(columns) - 7;  // sign, point and "-300"
        ASSERT_NEAR(*read / number, 1, columns == 24 ? 0.0 : 5.01 * std::pow(10, -digits)) << text;
      }
    }
  }
}

class NastranWrite : public NastranTest {};

// W2: columns 49 and on had been written into.
TEST_F(NastranWrite, KeepsAFieldInItsColumnsWhereItsLineEndsInIt) {
  MeshFile file = read(kFan);
  for (const double z : {0.073211572477307502, 7.5811189269110563e-6, -1234567.891, 0.0}) {
    positions_of(file)[4] = {0.4948401, 0.5007413, z};
    const std::vector<std::string> changed = changed_lines(kFan, written(file));
    ASSERT_THAT(changed, SizeIs(1));
    EXPECT_EQ(changed[0].size(), 48u) << changed[0];
    EXPECT_EQ(changed[0].substr(0, 24), "GRID    5               ");
    EXPECT_NEAR(*parse_nastran_real(trimmed(std::string_view(changed[0]).substr(40, 8))), z,
                1e-3 * std::abs(z));
  }
}

TEST_F(NastranWrite, PutsACoordinateWhereThereWasNone) {
  const std::string text =
      "GRID    1\r\nGRID    2               1.\r\nGRID,3,,,1.\r\nGRID,4\r\n"
      "GRID*   5                               .5\r\nGRID*,6,,1. $ comment\r\n"
      "GRID    7               .5      .25 $ comment\r\nGRID,8,,,1.,,,\r\n"
      "CQUAD4,1,,1,2,4,3\r\nCQUAD4,2,,5,6,7,8\r\n";
  MeshFile file = read(text);
  for (Vec3d& node : positions_of(file)) node += {0.25, 0.125, -0.5};
  const auto moved = positions_of(file);

  const std::string after = written(file);
  EXPECT_THAT(nodes_of(read(after)), ::testing::ElementsAreArray(moved)) << after;
  EXPECT_THAT(after, HasSubstr("GRID    1               .25     .125    -.5     \r\n"));
  EXPECT_THAT(after, HasSubstr("GRID    2               1.25    .125    -.5     \r\n"));
  EXPECT_THAT(after, HasSubstr("GRID,3,,.25,1.125,-.5\r\n"));
  EXPECT_THAT(after, HasSubstr("GRID,4,,.25,.125,-.5\r\n"));
  EXPECT_THAT(after, HasSubstr("GRID,8,,.25,1.125,-.5,,\r\n"));
}

TEST_F(NastranWrite, KeepsTabsAndTheFieldsBehindThem) {
  const std::string text =
      "GRID\t1\t\t.1\t.2\t.3\t\t123456\nGRID\t2\t\t\t\t\t\t123\nGRID\t3\t\t1.\t1.\n"
      "GRID*\t4\t\t\t\t.5\t\t.5\n*\t.5\nCTRIA3\t1\t\t1\t2\t3\nCTRIA3\t2\t\t1\t2\t4\n";
  MeshFile file = read(text);
  for (Vec3d& node : positions_of(file)) node += {1.0 / 3, -1.0 / 3, 1.0 / 7};
  const auto moved = positions_of(file);

  const MeshFile again = read(written(file));
  for (std::size_t node = 0; node < moved.size(); ++node) {
    EXPECT_NEAR(nodes_of(again)[node].y, moved[node].y, 1e-5);
    EXPECT_NEAR(nodes_of(again)[node].z, moved[node].z, 1e-5);
  }
  const std::string after = bytes_of(scratch_.path("out.bdf"));
  EXPECT_THAT(after, HasSubstr("\t.433333\t-.13333\t.442857\t\t123456\n"));
  EXPECT_THAT(after, HasSubstr("GRID\t2\t\t.333333\t-.33333\t.142857\t\t123\n"));
}

TEST_F(NastranWrite, ChangesNothingElse) {
  const std::string text = test::with_crlf(
      "$ Gr\xC3\xBC\xC3\x9F"
      "e, and Latin-1: \xFC\nSOL 101\nCEND\n  begin bulk\n"
      "grid    1                     1.      0.      0.       0  123456\n"
      "GRID*   2                                          1.5D1         -1.5D-1*A\n"
      "$ between\n*A      1.5D0\n"
      "GRID  ,  3 , , -1. , 1.5-1 ,  .5  , ,  $ note\n"
      "CTRIA3  1       1       1       2       3\nendDATA\n trailing");
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  positions_of(file)[0] = {1, 1.0 / 3, 0};
  positions_of(file)[1].z = 2.0 / 3;
  positions_of(file)[2].y = 1.0 / 3;
  EXPECT_THAT(changed_lines(text, written(file)),
              ElementsAre("grid    1                     1..3333333      0.       0  123456\r",
                          "*A      .666666666666667\r",
                          "GRID  ,  3 , , -1. , .3333333333333333 ,  .5  , ,  $ note\r"));
}

TEST_F(NastranWrite, KeepsALineOfFreeFieldsWithinEightyColumns) {
  MeshFile file = read(
      "GRID,10000001,,.1,.2,.3,,123456\nGRID,2,,1.\nGRID,3,,,1.\n"
      "CTRIA3,1,1,10000001,2,3\n");
  positions_of(file)[0] = {-1.0 / 3e-7, -2.0 / 3e-7, -1.0 / 7e-7};
  const std::string line = test::lines_of(written(file)).front();
  EXPECT_LE(line.size(), 80u) << line;
  EXPECT_GE(line.size(), 76u) << line;
}

TEST_F(NastranWrite, ChangesIncludedFilesOverItselfAndIsOneFileElsewhere) {
  put_bytes(scratch_.path("grids.dat"), kGrids);
  put_bytes(scratch_.path("elements.dat"), "CTETRA,1,1,1,2,3,4");
  const std::string main = "BEGIN BULK\nINCLUDE 'grids.dat'\nINCLUDE 'elements.dat'\nENDDATA\n";
  MeshFile file = read(main);
  positions_of(file)[3].z = 2;

  EXPECT_EQ(written(file),
            "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\n"
            "GRID,4,,0.,0.,2.\nCTETRA,1,1,1,2,3,4\nENDDATA\n");
  EXPECT_EQ(bytes_of(scratch_.path("grids.dat")), kGrids);
  EXPECT_EQ(written(file, "in.bdf"), main);
  EXPECT_THAT(changed_lines(kGrids, bytes_of(scratch_.path("grids.dat"))),
              ElementsAre("GRID,4,,0.,0.,2."));
}

TEST_F(NastranWrite, MovesBothCardsOfANodeThatIsThereTwice) {
  MeshFile file = read(kFan + "GRID,5,,.31,.64,.1\n");
  positions_of(file)[4].z = 0.5;
  EXPECT_THAT(changed_lines(kFan + "GRID,5,,.31,.64,.1\n", written(file)), SizeIs(2));
  EXPECT_EQ(positions_of(file = read(written(file)))[4].z, 0.5);
}

TEST_F(NastranWrite, WritesTheSameNumbersIntoCardsOfDifferentWidths) {
  const std::string again =
      "GRID,5,,.31,.64,.1\n"
      "GRID*                  5                             .31             .64\n"
      "*                     .1\n"
      "GRID           5             .31     .64      .1\n";
  MeshFile file = read(kFan + again);
  positions_of(file)[4] = {1.0 / 3, -2.0 / 3, 1e-5 / 3};
  EXPECT_NEAR(positions_of(file = read(written(file)))[4].x, 1.0 / 3, 1e-6);
  EXPECT_NEAR(positions_of(file)[4].y, -2.0 / 3, 1e-5);
}

TEST_F(NastranWrite, MakesADeckOfAnotherFormatWithoutGmsh) {
  put_bytes(
      scratch_.path("a.su2"),
      "NDIME= 3\nNELEM= 1\n10 0 1 2 3\nNPOIN= 4\n0 0 0\n.333333333333333333 0 0\n0 1 0\n0 0 -1e-7\n"
      "NMARK= 1\nMARKER_TAG= wall\nMARKER_ELEMS= 1\n5 0 1 2\n");
  write_mesh_file(scratch_.path("a.nas"), read_mesh_file(scratch_.path("a.su2")));
  MeshFile file = read_mesh_file(scratch_.path("a.nas"));
  EXPECT_EQ(file.mesh.element_count(), 1u);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 1);
  EXPECT_EQ(positions_of(file)[1].x, 0.333333333333333);
  EXPECT_EQ(positions_of(file)[3].z, -1e-7);
}

// --- coordinate systems ---------------------------------------------------------------

const std::string kSystems =
    "CORD2R,1,,1.,0.,0.,1.,0.,1.\n,1.,1.,0.\n"   // x is y, y is -x
    "CORD2C,2,1,1.,0.,0.,1.,0.,1.\n,2.,0.,0.\n"  // in system 1
    "CORD2S,3,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
    "CORD1R,4,1,2,3,5,1,3,2\n";

TEST_F(NastranWrite, ReadsNodesInSystemsOfTheirOwn) {
  const MeshFile file = read(kSystems +
                             "GRDSET,,3\nGRID,1,0\nGRID,2,0,0.,0.,2.\nGRID,3,0,1.,0.,0.\n"
                             "GRID,4,1,1.,2.,3.\nGRID,5,2,2.,90.,1.\nGRID,6,,2.,90.,90.\n"
                             "GRID,7,4,1.,2.,3.\nCTRIA3,1,1,4,5,6\nCTRIA3,2,1,4,5,7\n");
  const auto& nodes = nodes_of(file);
  EXPECT_EQ(nodes[3], (Vec3d{-1, 1, 3}));
  EXPECT_EQ(nodes[4], (Vec3d{-1, 1, 1}));
  EXPECT_EQ(nodes[5], (Vec3d{0, 2, 0}));
  EXPECT_EQ(nodes[6], (Vec3d{1, 2, 3}));
  EXPECT_EQ(file.mesh.fixed.at(0) + file.mesh.fixed.at(1) + file.mesh.fixed.at(2), 3)
      << "what else stands in system 4 must not turn";
  EXPECT_EQ(file.mesh.fixed.at(3), 0);
}

TEST_F(NastranWrite, WritesNodesBackInTheirSystems) {
  const std::string text =
      kSystems +
      "GRID,1\nGRID,2,,0.,0.,2.\nGRID,3,,1.,0.,0.\nGRID    4       1       1.      2.      3.\n"
      "GRID    5       2       2.      450.    1.\nGRID    6       3       2.      90.     -270.\n"
      "CTRIA3,1,1,4,5,6\nCTRIA3,2,1,1,2,3\n";
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  positions_of(file)[3] += {0, 0, 0.5};
  positions_of(file)[4] = {-1, 1.5, 1};
  positions_of(file)[5] = {0, 0, 4};
  EXPECT_THAT(changed_lines(text, written(file)),
              ElementsAre("GRID    4       1       1.      2.      3.5     ",
                          "GRID    5       2       2.061553435.96381.",
                          "GRID    6       3       4.      0.      -270."));
  positions_of(file)[4] = {1, 1, 1};  // on the axis
  EXPECT_THAT(written(file), HasSubstr("GRID    5       2       0.      450.    1.\n"));
}

TEST_F(NastranWrite, RefusesSystemsThatAreNone) {
  const std::string rest = "GRID,1,7,1.\nGRID,2\nGRID,3,,,1.\nCTRIA3,1,1,1,2,3\n";
  EXPECT_THAT(error("CORD2R,7,8,,,,,,1.\n,1.\nCORD2C,8,7,,,,,,1.\n,1.\n" + rest).second,
              HasSubstr("is defined by itself"));
  EXPECT_THAT(error("CORD1R,7,1,2,3\n" + rest).second, HasSubstr("is defined by itself"));
  EXPECT_THAT(error("CORD2R,7,,,,,,,1.\n,,,2.\n" + rest).second,
              HasSubstr("line 1: the coordinate system 7 is defined by three points in a line"));
  EXPECT_THAT(error("CORD2R,7,9,,,,,,1.\n,1.\n" + rest).second,
              HasSubstr("refers to a system or a GRID that is not in the deck"));
  EXPECT_THAT(error("CORD2R,7,,,,,,,1.\n,1.\nCORD2C,7,,,,,,,1.\n,1.\n" + rest).second,
              HasSubstr("line 3: the coordinate system 7 is defined twice, first in line 1"));
}

TEST(CoordinateFrame, KeepsTheBranchOfAnglesAndTheSignOfRadii) {
  using Kind = CoordinateFrame::Kind;
  for (const Kind kind : {Kind::rectangular, Kind::cylindrical, Kind::spherical}) {
    CoordinateFrame frame;
    frame.kind = kind;
    frame.origin = {1, 2, 3};
    frame.axes = {Vec3d{0, 1, 0}, Vec3d{0, 0, 1}, Vec3d{1, 0, 0}};
    for (const double radius : {2.0, -2.0, 0.25}) {
      for (const double theta : {-400.0, -90.0, 30.0, 200.0, 725.0}) {
        for (const double phi : {-700.0, -10.0, 100.0, 350.0}) {
          const Vec3d local = {radius, theta, phi};
          const Vec3d near = {radius * 1.01, theta + 3, phi - 3};
          const Vec3d again = frame.to_local(frame.to_basic(near), local);
          EXPECT_NEAR(again.x, near.x, 1e-9);
          EXPECT_NEAR(again.y, near.y, 1e-9);
          EXPECT_NEAR(again.z, near.z, 1e-9);
          EXPECT_EQ(frame.to_local(frame.to_basic(local), local), local);
        }
      }
    }
  }
}

}  // namespace
}  // namespace meshsmooth::formats
