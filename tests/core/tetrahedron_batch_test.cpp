// Batches of tetrahedra compared against the measure of one element.

#include "mesh/tetrahedron_batch.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "mesh/measure_batch.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {
namespace {

using detail::TetrahedronBatch;

constexpr std::array<NodeId, 4> kNodes = {0, 1, 2, 3};
constexpr double kLeast = 0.4;  // of the mean ratio
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array kScales = {1.0, 1e-120, 1e-60, 1e-53, 1e-51, 1e-20, 1e20, 1e51, 1e60, 1e150};

using Corners = std::array<Vec3d, 4>;

Corners random_corners(std::mt19937_64& random, double scale) {
  std::uniform_real_distribution<double> place(-scale, scale);
  Corners corners;
  for (Vec3d& p : corners) p = {place(random), place(random), place(random)};
  return corners;
}

/// A batch whose tetrahedra differ, `corners` among them, and which.
struct Mixed {
  TetrahedronBatch batch{};
  int at;

  Mixed(std::mt19937_64& random, const Corners& corners)
      : at(static_cast<int>(random() % TetrahedronBatch::kSize)) {
    for (int t = 0; t < TetrahedronBatch::kSize; ++t) {
      const Corners other = t == at ? corners : random_corners(random, 1);
      batch.set(t, other.data(), kNodes.data());
    }
  }
};

std::uint64_t bits_of(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return std::isnan(value) ? ~std::uint64_t{0} : bits;
}

void expect_as_measured(std::mt19937_64& random, const Corners& corners) {
  const Mixed mixed(random, corners);
  const ElementMeasure own = detail::measure_tetrahedra(mixed.batch)[mixed.at];
  const ElementMeasure measure = detail::measure_tetrahedron(corners.data());
  EXPECT_EQ(bits_of(own.mean_ratio), bits_of(measure.mean_ratio));
  EXPECT_EQ(bits_of(own.scaled_jacobian), bits_of(measure.scaled_jacobian));
  EXPECT_EQ(bits_of(own.radius_ratio), bits_of(measure.radius_ratio));
  EXPECT_EQ(bits_of(own.min_angle_cos), bits_of(measure.min_angle_cos));
  EXPECT_EQ(bits_of(own.max_angle_cos), bits_of(measure.max_angle_cos));
  EXPECT_EQ(bits_of(own.volume), bits_of(measure.volume));
  EXPECT_EQ(own.inverted, measure.inverted);
  EXPECT_EQ(own.degenerate, measure.degenerate);

  const auto found = detail::find_clear(mixed.batch, kLeast * kLeast * kLeast);
  if (!found.clear(mixed.at)) return;
  EXPECT_EQ(found.volume(mixed.at), measure.volume);
  EXPECT_FALSE(measure.inverted);
  EXPECT_FALSE(measure.degenerate);
  EXPECT_GE(measure.mean_ratio, kLeast * (1 - 1e-12));
}

TEST(TetrahedronBatch, IsMeasuredAsEveryElementAlone) {
  std::mt19937_64 random(1);
  for (const double scale : kScales) {
    for (int i = 0; i < 2000; ++i) expect_as_measured(random, random_corners(random, scale));
  }
  for (const Vec3d top : {Vec3d{1, 1, 0}, Vec3d{1, 1, 1e-17}, Vec3d{0, 0, -1}, Vec3d{0, 0, 0},
                          Vec3d{kNan, 0, 1}, Vec3d{0, kInfinity, 1}}) {
    expect_as_measured(random, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, top}});
  }
}

TEST(TetrahedronBatch, HasTheSameBitsInVectorsOfAnyWidth) {
  std::mt19937_64 random(1);
  const auto volume = [](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
    return std::array{dot(p1 - p0, cross(p2 - p0, p3 - p0)) / norm(p2 - p1)};
  };
  for (const double scale : kScales) {
    const Mixed mixed(random, random_corners(random, scale));
    const auto evaluate = [&] { return mixed.batch.evaluate<1>(volume)[0]; };
    const auto wide = detail::run_wide(evaluate), plain = detail::run_plainly(evaluate);
    for (std::size_t t = 0; t < wide.size(); ++t) EXPECT_EQ(bits_of(wide[t]), bits_of(plain[t]));
  }
}

TEST(TetrahedronBatch, FindsGoodOnesClear) {
  const Corners corners = {{{0, 0, 0},
                            {1, 0, 0},
                            {0.5, std::sqrt(0.75), 0},
                            {0.5, std::sqrt(1.0 / 12), std::sqrt(2.0 / 3)}}};
  TetrahedronBatch batch{};
  batch.set(3, corners.data(), kNodes.data());
  const auto found = detail::find_clear(batch, 0.5);
  EXPECT_TRUE(found.clear(3));
  EXPECT_FALSE(found.clear(2));  // nothing was set
}

TEST(TetrahedronBatch, IsNotClearOfWhatIsFlatOrNoNumber) {
  for (const Vec3d top : {Vec3d{1, 1, 0}, Vec3d{1, 1, 1e-17}, Vec3d{0, 0, -1}, Vec3d{kNan, 0, 1},
                          Vec3d{0, kInfinity, 1}}) {
    const Corners corners = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, top}};
    TetrahedronBatch batch{};
    batch.set(0, corners.data(), kNodes.data());
    EXPECT_FALSE(detail::find_clear(batch, -1).clear(0));
  }
}

}  // namespace
}  // namespace meshsmooth
