// Brief evaluation compared against the measure of one element.

#include "mesh/tetrahedron_batch.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "meshsmooth/quality.hpp"

namespace meshsmooth {
namespace {

using detail::TetrahedronBatch;

constexpr std::array<NodeId, 4> kNodes = {0, 1, 2, 3};
constexpr double kLeast = 0.4;  // of the mean ratio

std::array<Vec3d, 4> random_corners(std::mt19937_64& random, double scale) {
  std::uniform_real_distribution<double> place(-scale, scale);
  std::array<Vec3d, 4> corners;
  for (Vec3d& p : corners) p = {place(random), place(random), place(random)};
  return corners;
}

void expect_as_measured(const std::array<Vec3d, 4>& corners) {
  TetrahedronBatch wide, plain;
  for (int t = 0; t < TetrahedronBatch::kSize; ++t) {
    wide.set(t, corners.data(), kNodes.data());
    plain.set(t, corners.data(), kNodes.data());
  }
  wide.compute(kLeast * kLeast * kLeast);
  plain.compute_plainly(kLeast * kLeast * kLeast);
  const ElementMeasure measure =
      measure_element(ElementType::tetrahedron, corners.data(), {0, 0, 0});
  for (int t = 0; t < TetrahedronBatch::kSize; ++t) {
    EXPECT_EQ(wide.clear(t), plain.clear(t));
    if (!wide.clear(t)) continue;
    EXPECT_EQ(wide.volume(t), plain.volume(t));
    EXPECT_EQ(wide.volume(t), measure.volume);
    EXPECT_FALSE(measure.inverted);
    EXPECT_FALSE(measure.degenerate);
    EXPECT_GE(measure.mean_ratio, kLeast * (1 - 1e-12));
  }
}

TEST(TetrahedronBatch, SaysOfNoneThatItIsClearThatIsNot) {
  std::mt19937_64 random(1);
  for (const double scale : {1.0, 1e-120, 1e-60, 1e-53, 1e-51, 1e-20, 1e20, 1e51, 1e60, 1e150}) {
    for (int i = 0; i < 2000; ++i) expect_as_measured(random_corners(random, scale));
  }
}

TEST(TetrahedronBatch, FindsGoodOnesClear) {
  const std::array<Vec3d, 4> corners = {{{0, 0, 0},
                                         {1, 0, 0},
                                         {0.5, std::sqrt(0.75), 0},
                                         {0.5, std::sqrt(1.0 / 12), std::sqrt(2.0 / 3)}}};
  TetrahedronBatch batch;
  batch.set(3, corners.data(), kNodes.data());
  batch.compute(0.5);
  EXPECT_TRUE(batch.clear(3));
  EXPECT_FALSE(batch.clear(2));  // nothing was set
}

TEST(TetrahedronBatch, IsNotClearOfWhatIsFlatOrNoNumber) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Vec3d top : {Vec3d{1, 1, 0}, Vec3d{1, 1, 1e-17}, Vec3d{0, 0, -1}, Vec3d{kNan, 0, 1},
                          Vec3d{0, kInfinity, 1}}) {
    const std::array<Vec3d, 4> corners = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, top}};
    TetrahedronBatch batch;
    batch.set(0, corners.data(), kNodes.data());
    batch.compute(-1);
    EXPECT_FALSE(batch.clear(0));
  }
}

}  // namespace
}  // namespace meshsmooth
