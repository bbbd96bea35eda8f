// Which tetrahedra stay positive whichever part of their nodes' moves is taken, or wherever in
// balls their nodes are.

#include "smooth/guard/partial_moves.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "smooth/base/element_quality.hpp"

namespace meshsmooth {
namespace {

template <class Real>
using Corners = std::array<Vec3<Real>, 4>;

template <class Real>
struct Ways {
  Corners<Real> before, after;

  [[nodiscard]] bool certain() const {
    return detail::is_positive_on_the_way<Real>(
        [&](int n) { return before[static_cast<std::size_t>(n)]; },
        [&](int n) { return after[static_cast<std::size_t>(n)]; });
  }
  /// At the positions to which moves are halved: each node at one of five.
  [[nodiscard]] bool positive_everywhere() const {
    constexpr int kParts = 5;
    std::array<Corners<Real>, kParts> at{after, after, after, after, before};
    for (int part = 1; part + 1 < kParts; ++part) {
      for (std::size_t n = 0; n < 4; ++n) {
        at[part][n] = before[n] + Real(0.5) * (at[part - 1][n] - before[n]);
      }
    }
    for (int choice = 0; choice < kParts * kParts * kParts * kParts; ++choice) {
      std::array<Vec3d, 4> p;
      for (std::size_t n = 0, rest = static_cast<std::size_t>(choice); n < 4; ++n, rest /= kParts) {
        p[n] = vec3_cast<double>(at[rest % kParts][n]);
      }
      if (!detail::tetrahedron_is_positive(p[0], p[1], p[2], p[3])) return false;
    }
    return true;
  }
};

/// A random tetrahedron of about the size 1, at a place, whose nodes move as far as `reach`.
template <class Real>
Ways<Real> random_ways(std::mt19937_64& random, double place, double reach, double scale) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto point = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  Ways<Real> ways;
  const Vec3d centre = place * point();
  for (std::size_t n = 0; n < 4; ++n) {
    const Vec3d p = centre + point();
    ways.before[n] = vec3_cast<Real>(scale * p);
    ways.after[n] = vec3_cast<Real>(scale * (p + reach * point()));
  }
  return ways;
}

template <class Real>
class PartialMoves : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(PartialMoves, Reals);

TYPED_TEST(PartialMoves, AreCertainOnlyWherePositive) {
  std::mt19937_64 random(1);
  int certain = 0;
  for (const double place : {0.0, 1.0, 100.0, 1e4}) {
    for (const double reach : {0.0, 1e-3, 0.1, 0.5}) {
      for (const double scale : {1.0, 1e-3, 1e3}) {
        for (int n = 0; n < 200; ++n) {
          const Ways<TypeParam> ways = random_ways<TypeParam>(random, place, reach, scale);
          if (!ways.certain()) continue;
          ++certain;
          ASSERT_TRUE(ways.positive_everywhere()) << place << " " << reach << " " << scale;
        }
      }
    }
  }
  EXPECT_GT(certain, 1000);
}

TYPED_TEST(PartialMoves, AreCertainOfGoodElementsThatHardlyMove) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<TypeParam> unit(TypeParam(-0.01), TypeParam(0.01));
  Ways<TypeParam> ways{{{{10, 10, 10}, {11, 10, 10}, {10, 11, 10}, {10, 10, 11}}}, {}};
  for (int n = 0; n < 1000; ++n) {
    for (std::size_t k = 0; k < 4; ++k) {
      ways.after[k] = ways.before[k] + Vec3<TypeParam>{unit(random), unit(random), unit(random)};
    }
    EXPECT_TRUE(ways.certain());
  }
}

TYPED_TEST(PartialMoves, AreNotCertainWhereAPartInverts) {
  // All nodes move as one: at both ends it is the same, where one alone moves it is flat.
  const Corners<TypeParam> at{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Ways<TypeParam> ways{at, at};
  for (auto& p : ways.after) p = p + Vec3<TypeParam>{0, 0, 1};
  EXPECT_FALSE(ways.certain());
  EXPECT_FALSE(ways.positive_everywhere());
}

TYPED_TEST(PartialMoves, AreNotCertainOfWhatIsNoNumberOrTooSmallForAFloat) {
  const Corners<TypeParam> at{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Ways<TypeParam> ways{at, at};
  ASSERT_TRUE(ways.certain());
  ways.after[2].y = std::numeric_limits<TypeParam>::quiet_NaN();
  EXPECT_FALSE(ways.certain());
  for (const TypeParam scale : {TypeParam(1e-20), TypeParam(1e30)}) {
    Corners<TypeParam> far = at;
    for (auto& p : far) p = scale * p;
    EXPECT_FALSE((Ways<TypeParam>{far, far}.certain())) << scale;
  }
}

/// Nodes anywhere within balls.
struct Balls {
  Vec3f centre[4];
  float radius[4];

  [[nodiscard]] bool certain() const { return detail::is_positive_within(centre, radius); }
  /// Where each node has moved along `way(n)`, in double, to the border of its ball.
  template <class Way>
  [[nodiscard]] bool positive_at(const Way& way) const {
    Vec3d p[4];
    for (int n = 0; n < 4; ++n) {
      const Vec3d d = way(n);
      p[n] = vec3_cast<double>(centre[n]) + (double{radius[n]} / std::sqrt(dot(d, d))) * d;
    }
    return detail::tetrahedron_is_positive(p[0], p[1], p[2], p[3]);
  }
  /// Towards the opposite face: where a node does most harm alone.
  [[nodiscard]] Vec3d inwards(int n) const {
    const auto other = [&](int k) { return vec3_cast<double>(centre[(n + k) % 4]); };
    const Vec3d normal = cross(other(2) - other(1), other(3) - other(1));
    const bool towards = dot(other(1) - vec3_cast<double>(centre[n]), normal) > 0;
    return towards ? normal : -1.0 * normal;
  }
};

TEST(PartialMovesInBalls, AreCertainOnlyWherePositive) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto direction = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  int certain = 0, flat = 0;
  for (const double place : {0.0, 1.0, 100.0, 1e4}) {
    for (const double reach : {0.0, 1e-3, 0.05, 0.2}) {
      for (const double flatness : {1.0, 1e-2, 1e-4, 1e-6}) {
        for (int n = 0; n < 300; ++n) {
          Balls balls{};
          for (int k = 0; k < 4; ++k) {
            const Vec3d p = direction() + Vec3d{place, 0, 0};
            balls.centre[k] = vec3_cast<float>(Vec3d{p.x, p.y, flatness * p.z});
            balls.radius[k] = static_cast<float>(reach * flatness * std::abs(unit(random)));
          }
          if (!balls.certain()) continue;
          ++certain;
          flat += flatness < 1 ? 1 : 0;
          ASSERT_TRUE(balls.positive_at([&](int k) { return balls.inwards(k); }));
          for (int k = 0; k < 50; ++k) {
            ASSERT_TRUE(balls.positive_at([&](int) { return direction(); }))
                << place << " " << reach << " " << flatness;
          }
        }
      }
    }
  }
  EXPECT_GT(certain, 2000);
  EXPECT_GT(flat, 1000);
}

TEST(PartialMovesInBalls, AreCertainWhileABallReachesASixthOfTheHeight) {
  const Vec3f at[] = {{0, 0, 0}, {1, 0, 0}, {0.5F, 0.866F, 0}, {0.5F, 0.289F, 0.816F}};
  Balls balls{{at[0], at[1], at[2], at[3]}, {}};
  const auto certain = [&](float radius) {
    for (float& r : balls.radius) r = radius;
    return balls.certain();
  };
  EXPECT_TRUE(certain(0.816F / 6));
  EXPECT_FALSE(certain(0.816F / 3));
}

TEST(PartialMovesInBalls, AreNotCertainOfWhatIsNoNumberOrTooSmallForAFloat) {
  Balls balls{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  ASSERT_TRUE(balls.certain());
  for (const float scale : {1e-20F, 1e30F}) {
    Balls far = balls;
    for (Vec3f& p : far.centre) p = scale * p;
    EXPECT_FALSE(far.certain()) << scale;
  }
  balls.radius[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(balls.certain());
}

}  // namespace
}  // namespace meshsmooth
