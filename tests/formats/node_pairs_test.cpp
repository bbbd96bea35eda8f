#include "node_pairs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Turns about the axis through `centre` by Rodrigues' formula.
Vec3d turned(const Vec3d& x, const Vec3d& centre, const Vec3d& axis, double angle) {
  const Vec3d k = (1 / norm(axis)) * axis;
  const Vec3d v = x - centre;
  const Vec3d along = ((1 - std::cos(angle)) * dot(k, v)) * k;
  return centre + std::cos(angle) * v + std::sin(angle) * cross(k, v) + along;
}

/// A sheet of 7 x 5 nodes; `grading` 1: evenly spaced.
std::vector<Vec3d> sheet(double grading) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 5; ++j) {
      points.push_back({2 + std::pow(i / 6.0, grading), 0, 0.7 * std::pow(j / 4.0, grading)});
    }
  }
  return points;
}

/// Two sides, the second in another order.
struct Sides {
  template <class Map>
  Sides(const std::vector<Vec3d>& points, const Map& map) : positions(points) {
    const auto count = static_cast<NodeId>(points.size());
    a.resize(points.size());
    b.resize(points.size());
    std::iota(a.begin(), a.end(), 0);
    std::iota(b.begin(), b.end(), count);
    positions.resize(2 * points.size());
    for (NodeId node = 0; node < count; ++node) {
      partners.push_back(count + (7 * node + 3) % count);  // 7 does not divide the counts below
      positions[static_cast<std::size_t>(partners.back())] =
          map(points[static_cast<std::size_t>(node)]);
    }
  }
  [[nodiscard]] std::vector<NodePair> match() const {
    return match_sides(std::span<const Vec3d>(positions), {"left", a}, {"right", b}, "--periodic");
  }
  void expect_matched() const {
    const auto pairs = match();
    ASSERT_EQ(pairs.size(), a.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(pairs[i], (NodePair{a[i], partners[i]}));
  }

  std::vector<Vec3d> positions;
  std::vector<NodeId> a, b, partners;
};

/// Without the last nodes: the count of a whole sheet is a multiple of 7.
std::vector<Vec3d> part_of_sheet(double grading) {
  std::vector<Vec3d> points = sheet(grading);
  points.resize(33);
  return points;
}

TEST(MatchSides, FindsATranslation) {
  for (const double grading : {1.0, 1.4}) {
    Sides(part_of_sheet(grading), [](Vec3d p) { return p + Vec3d{0.3, 5, -1}; }).expect_matched();
  }
}

TEST(MatchSides, FindsARotationAboutTheAxisOfASector) {
  for (const double angle : {0.2, 1.2, 3.0}) {
    Sides(part_of_sheet(1.4), [&](Vec3d p) {
      return turned(p, {0, 0, 0}, {0, 0, 1}, angle);
    }).expect_matched();
  }
}

TEST(MatchSides, FindsARotationAboutAnyAxis) {
  for (const double angle : {0.4, 2.0, 3.141592653589793}) {
    Sides(part_of_sheet(1.4), [&](Vec3d p) {
      return turned(p, {1, -2, 3}, {1, 0.5, -2}, angle);
    }).expect_matched();
  }
}

TEST(MatchSides, FindsTheLeastTurnOfAnEvenSheet) {
  std::vector<Vec3d> points = sheet(1);
  points.resize(30);  // 6 x 5, even
  Sides(points, [](Vec3d p) { return turned(p, {0, 0, 0}, {0, 0, 1}, 0.5); }).expect_matched();
}

TEST(MatchSides, FindsTheSidesOfAPlaneSector) {
  std::vector<Vec3d> line;
  for (int i = 0; i < 9; ++i) line.push_back({1 + 0.1 * i + 0.01 * i * i, 0, 0});
  Sides(line, [](Vec3d p) { return turned(p, {0, 0, 0}, {0, 0, 1}, 0.9); }).expect_matched();
}

TEST(MatchSides, TakesANodeOfBothSidesForItsOwnPartner) {
  const std::vector<Vec3d> positions = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {0, 1, 0}, {0, 3, 0}};
  const std::vector<NodeId> a = {0, 1, 2}, b = {0, 3, 4};
  EXPECT_EQ(match_sides(std::span<const Vec3d>(positions), {"a", a}, {"b", b}, "--periodic"),
            (std::vector<NodePair>{{0, 0}, {1, 3}, {2, 4}}));
}

std::string error_of(const Sides& sides) {
  try {
    (void)sides.match();
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.reason(), "PERIODIC_MISMATCH");
    return error.what();
  }
  return "none";
}

TEST(MatchSides, NamesWhatDoesNotMatch) {
  Sides sides(part_of_sheet(1.4), [](Vec3d p) { return p + Vec3d{0, 5, 0}; });
  sides.positions[static_cast<std::size_t>(sides.partners[11])].z += 0.033;
  EXPECT_THAT(error_of(sides), AllOf(HasSubstr("\"left\" to \"right\""), HasSubstr("node 11 is"),
                                     HasSubstr("0.032"), HasSubstr("tolerance")));
  sides.b.pop_back();
  EXPECT_THAT(error_of(sides),
              AllOf(HasSubstr("\"left\" has 33 nodes"), HasSubstr("\"right\" has 32")));
  sides.a.clear();
  sides.b.clear();
  EXPECT_THAT(error_of(sides), HasSubstr("has 0 nodes"));
}

}  // namespace
}  // namespace meshsmooth::formats
