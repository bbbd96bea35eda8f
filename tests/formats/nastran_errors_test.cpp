// Nastran decks: what is refused.

#include <gmock/gmock.h>

#include "nastran_deck.hpp"

namespace meshsmooth::formats {
namespace {

using test::kFan;
using test::kGrids;
using test::NastranTest;
using ::testing::HasSubstr;

class NastranRefusal : public NastranTest {};

struct Wrong {
  const char* deck;
  const char* reason;
  const char* text;
};
void PrintTo(const Wrong& wrong, std::ostream* out) { *out << wrong.deck; }

class NastranErrors : public NastranTest, public ::testing::WithParamInterface<Wrong> {};

TEST_P(NastranErrors, NameTheCardAndTheLine) {
  const auto [reason, text] = error(kFan + GetParam().deck);
  EXPECT_EQ(reason, GetParam().reason);
  EXPECT_THAT(text, HasSubstr(GetParam().text));
}

INSTANTIATE_TEST_SUITE_P(
    Nastran, NastranErrors,
    ::testing::Values(
        Wrong{"GRID,9,,1.x,0.,0.\n", "FORMAT_ERROR",
              "line 10: expected a number in field 4 of GRID, found \"1.x\""},
        Wrong{"GRID,0\n", "FORMAT_ERROR", "expected the id of GRID, a number above 0, found \"0\""},
        Wrong{"CTRIA3,9,1,1,2,77\n", "FORMAT_ERROR",
              "line 10: CTRIA3 9 uses node 77, which is not in the deck"},
        Wrong{"CQUAD4,9,1,1,2,3\n", "FORMAT_ERROR", "line 10: CQUAD4 9 has 3 of its 4 corners"},
        Wrong{"CTRIA3,1,1,3,4,5\n", "FORMAT_ERROR",
              "CTRIA3 1 has the id of another element, in line 6"},
        Wrong{"GRID,9,4,1.,2.,3.\n", "FORMAT_ERROR",
              "GRID 9 is in the coordinate system 4, which is not in the deck"},
        Wrong{"=,*1,=,=,=\n", "FORMAT_ERROR", "not the replication of another one"},
        Wrong{"CHEXA,9,1,1,2,3,4,5,1,2,3\n", "FORMAT_ERROR", "expected at most 8 fields"},
        Wrong{"SET1,1,a\n", "FORMAT_ERROR", "line 10: expected the ids of a set"}));

TEST_F(NastranRefusal, RefusesAContinuationOfNothingAndADeckWithoutElements) {
  EXPECT_THAT(error("+,1,2\n").second,
              HasSubstr("line 1: expected a card before its continuation"));
  EXPECT_EQ(error(kGrids).first, "MESH_EMPTY");
  EXPECT_EQ(error(std::string("GRID,1\0", 7)).first, "FORMAT_ERROR");
}

}  // namespace
}  // namespace meshsmooth::formats
