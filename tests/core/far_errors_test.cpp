// Optimize on errors that are far from their cure, and on few in a large mesh.

#include <gtest/gtest.h>

#include "core/smoothing.hpp"
#include "smooth/optimize/anderson.hpp"
#include "support/descent.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

using test::Job;
using test::mean_ratio;

Job optimized(const Mesh& mesh, BoundaryPolicy boundary = BoundaryPolicy::fixed) {
  Job job = test::smooth(mesh, {.boundary = boundary});
  EXPECT_TRUE(test::keeps_valid_elements(mesh, job.mesh));
  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
  EXPECT_EQ(job.summary.quality_after.degenerate_count, 0);
  return job;
}

TEST(FarErrors, AreCured) {
  for (const test::FarError& error : test::far_errors(1)) {
    SCOPED_TRACE(error.name);
    const Mesh mesh = error.mesh();
    EXPECT_LT(mean_ratio(measure_quality(mesh)).min, 0.05);
    const Job job = optimized(mesh, error.boundary);
    EXPECT_GE(mean_ratio(job.summary.quality_after).min, error.least_mean_ratio);
  }
}

TEST(FarErrors, OfARotatedHubAreCuredInSweepsThatGrowLikeTheRows) {
  const auto sweeps = [](int rows) {
    return optimized(test::hub(rows, 30, 0).mesh()).summary.convergence.iteration_count;
  };
  EXPECT_LE(sweeps(48), 3.2 * sweeps(24));
}

TEST(LocalErrors, AreCuredAlikeInMeshesOfEverySize) {
  for (const int cells : {24, 36}) {
    const Job job = optimized(formats::generate_damage({.cells = cells}).mesh);
    EXPECT_GE(test::stats_of(job.summary.quality_after, QualityMetric::min_dihedral_angle).min,
              44.0)
        << cells;
    EXPECT_LE(job.summary.convergence.iteration_count, 15) << cells;
  }
}

/// Wherever the job ends, a valid mesh stays valid and its energy does not rise.
TEST(FarErrors, LeaveAValidMeshValidWhereverTheJobEnds) {
  const Mesh mesh = test::hub(24, 15, 0).mesh();
  ASSERT_EQ(measure_quality(mesh).inverted_count, 0);
  ASSERT_LT(mean_ratio(measure_quality(mesh)).min, 0.05);
  double before = test::oracle::mean_energy(mesh, 2);
  for (int sweeps = 10; sweeps < 120; sweeps += 7) {
    const Job job = test::smooth(mesh, {.max_iterations = sweeps});
    EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << sweeps;
    EXPECT_LE(test::oracle::mean_energy(job.mesh, 2), before * (1 + 1e-13)) << sweeps;
    before = test::oracle::mean_energy(job.mesh, 2);
  }
}

TEST(FarErrors, EndInTheSameBitsForEveryNumberOfThreads) {
  const Mesh mesh = test::hub(24, 30, 0).mesh();
  const Job one = test::smooth(mesh, {}, 1);
  EXPECT_TRUE(test::same_bits(one.mesh, test::smooth(mesh, {}, 5).mesh));
}

TEST(LeastSquares, FindsTheCombinationOfLeastLength) {
  // v = own, and three others: the residual must be normal to all differences.
  const double v[4][5] = {{1, 2, 0, -1, 3}, {0, 1, 1, -2, 2}, {2, 2, 1, 0, 1}, {1, 0, 0, 1, 1}};
  std::array<detail::Factors, detail::kKeptSweeps> products{};
  const auto dot = [](const double* a, const double* b) {
    double sum = 0;
    for (int k = 0; k < 5; ++k) sum += a[k] * b[k];
    return sum;
  };
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) products[i][j] = dot(v[i], v[j]);
  }
  for (int own = 0; own < 4; ++own) {
    const auto factors = detail::least_squares(products, 4, own);
    ASSERT_TRUE(factors);
    EXPECT_EQ((*factors)[own], 0);
    double rest[5];
    for (int k = 0; k < 5; ++k) {
      rest[k] = v[own][k];
      for (int j = 0; j < 4; ++j) rest[k] -= (*factors)[j] * (v[own][k] - v[j][k]);
    }
    for (int j = 0; j < 4; ++j) {
      double difference[5];
      for (int k = 0; k < 5; ++k) difference[k] = v[own][k] - v[j][k];
      EXPECT_NEAR(dot(rest, difference), 0, 1e-6);
    }
  }
}

TEST(LeastSquares, IsNothingOfEqualVectors) {
  std::array<detail::Factors, detail::kKeptSweeps> products{};
  EXPECT_FALSE(detail::least_squares(products, 3, 1));
}

}  // namespace
}  // namespace meshsmooth
