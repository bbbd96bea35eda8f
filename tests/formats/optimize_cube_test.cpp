// What Optimize makes of the paper's cube: the figures of docs/results as floors.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "generate/generate.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth {
namespace {

struct Figures {
  double mean = 0;
  double worst_angle = 0;      // least dihedral angle, degrees
  double share_under_ten = 0;  // of the elements, by that angle
  std::int64_t inverted = 0;
  SmoothSummary summary;
};

Figures figures_of(const Mesh& mesh, SmoothSummary summary) {
  Figures figures;
  for (const MetricStats& stats : summary.quality_after.metrics) {
    if (stats.metric == QualityMetric::mean_ratio) figures.mean = stats.mean;
    if (stats.metric == QualityMetric::min_dihedral_angle) figures.worst_angle = stats.min;
  }
  figures.inverted = summary.quality_after.inverted_count + summary.quality_after.degenerate_count;
  const auto& positions = std::get<std::vector<Vec3d>>(mesh.positions);
  const std::vector<NodeId>& nodes = mesh.blocks.front().nodes;
  double under = 0;
  for (std::size_t e = 0; e < nodes.size(); e += 4) {
    Vec3d corners[4];
    for (std::size_t n = 0; n < 4; ++n) corners[n] = positions[nodes[e + n]];
    const auto measure = measure_element(ElementType::tetrahedron, corners, {0, 0, 0});
    under += measure.min_angle_cos > std::cos(10 * std::acos(-1.0) / 180) ? 1 : 0;
  }
  figures.share_under_ten = under / (static_cast<double>(nodes.size()) / 4);
  figures.summary = std::move(summary);
  return figures;
}

class Cube : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      static_cast<void>(formats::generate_cube(27, 1));
    } catch (const NotSupported&) {
      GTEST_SKIP() << "this build has no TetGen";
    }
  }

  static Figures optimize(std::size_t node_count, Goal goal, double tangle = 0,
                          double tolerance = 1e-4) {
    Mesh mesh = formats::generate_cube(node_count, 1, tangle);
    SmoothSummary summary = make_smoother("cpu", 2)->smooth(
        mesh, {.method = Optimize{.goal = goal}, .tolerance = {tolerance}});
    return figures_of(mesh, std::move(summary));
  }
};

TEST_F(Cube, BalancedIsGoodInTheMeanAndInTheWorst) {
  const Figures figures = optimize(10000, Goal::balanced);
  EXPECT_EQ(figures.inverted, 0);
  EXPECT_GE(figures.mean, 0.718);
  EXPECT_GE(figures.worst_angle, 5.8);
  EXPECT_LT(figures.share_under_ten, 0.0012);
  EXPECT_EQ(figures.summary.stop_reason, StopReason::converged);
  EXPECT_LE(figures.summary.convergence.iteration_count, 10);
}

TEST_F(Cube, AverageIsBestInTheMean) {
  const Figures figures = optimize(10000, Goal::average);
  EXPECT_EQ(figures.inverted, 0);
  EXPECT_GE(figures.mean, 0.724);
}

TEST_F(Cube, WorstIsBestInTheWorst) {
  const Figures figures = optimize(10000, Goal::worst);
  EXPECT_EQ(figures.inverted, 0);
  EXPECT_GE(figures.worst_angle, 9.5);
}

TEST_F(Cube, IsBetterYetWithASlidingBoundary) {
  const Mesh given = formats::generate_cube(10000, 1);
  Mesh mesh = given;
  SmoothSummary summary = make_smoother("cpu", 2)->smooth(
      mesh, {.method = Optimize{}, .boundary = BoundaryPolicy::slide});
  const auto& before = std::get<std::vector<Vec3d>>(given.positions);
  const auto& after = std::get<std::vector<Vec3d>>(mesh.positions);
  Vec3d low = before.front(), high = before.front();
  for (const Vec3d& p : before) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  for (std::size_t n = 0; n < before.size(); ++n) {
    for (double Vec3d::*const c : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
      if (before[n].*c == low.*c || before[n].*c == high.*c) {
        EXPECT_EQ(after[n].*c, before[n].*c) << n;
      }
    }
  }
  const double volume = summary.quality_before.sum_absolute_volume;
  EXPECT_NEAR(summary.quality_after.sum_absolute_volume, volume, 1e-12 * volume);
  EXPECT_EQ(summary.nodes.fixed, 8);
  EXPECT_EQ(summary.nodes.sliding_in_plane + summary.nodes.sliding_on_line + 8,
            summary.nodes.boundary);
  const Figures slid = figures_of(mesh, std::move(summary));
  const Figures held = optimize(10000, Goal::balanced);
  EXPECT_EQ(slid.inverted, 0);
  EXPECT_GE(slid.mean, held.mean + 0.004);
  EXPECT_LT(slid.share_under_ten, held.share_under_ten / 2);
  EXPECT_GE(slid.worst_angle, 8.0);
}

TEST_F(Cube, HoldsItsFiguresWithAHundredThousandNodes) {
  const Figures balanced = optimize(100000, Goal::balanced);
  EXPECT_EQ(balanced.inverted, 0);
  EXPECT_GE(balanced.mean, 0.721);
  const Figures worst = optimize(100000, Goal::worst);
  EXPECT_EQ(worst.inverted, 0);
  EXPECT_GE(worst.worst_angle, 6.5);
}

TEST_F(Cube, IsUntangledToTheSameOptimumFromEveryStart) {
  const double best = optimize(10000, Goal::balanced, 0, 1e-5).mean;
  for (const double share : {0.075, 0.3, 0.45}) {
    const Figures figures = optimize(10000, Goal::balanced, share, 1e-5);
    const QualityStats& before = figures.summary.quality_before;
    EXPECT_NEAR(
        static_cast<double>(before.inverted_count) / static_cast<double>(before.element_count),
        share, 0.01);
    EXPECT_EQ(figures.inverted, 0) << share;
    EXPECT_NEAR(figures.mean, best, 0.002) << share;
  }
}

}  // namespace
}  // namespace meshsmooth
