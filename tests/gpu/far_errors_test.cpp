// What far errors end in does not depend on the backend, even where bits do.

#include <gtest/gtest.h>

#include <cstdio>

#include "core/smoothing.hpp"
#include "support/cuda_device.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

using test::mean_ratio;

class CudaFarErrors : public test::CudaTest {
 protected:
  /// Smooths on both; tells what for the records.
  static void expect_alike(const std::string& name, const Mesh& mesh, const SmoothOptions& options,
                           double least_mean_ratio) {
    SCOPED_TRACE(name);
    SmoothSummary summaries[2];
    for (const bool cuda : {false, true}) {
      Mesh copy = mesh;
      SmoothSummary& summary = summaries[cuda ? 1 : 0];
      summary = make_smoother(cuda ? "cuda:0" : "cpu")->smooth(copy, options);
      EXPECT_EQ(summary.stop_reason, StopReason::converged);
      EXPECT_EQ(summary.quality_after.inverted_count, 0);
      EXPECT_GE(mean_ratio(summary.quality_after).min, least_mean_ratio);
      std::printf(
          "%s on %s: %lld inverted, %d sweeps, mean ratio %.4f to %.4f, mean %.4f, %.1f ms\n",
          name.c_str(), summary.backend.c_str(),
          static_cast<long long>(summary.quality_before.inverted_count),
          summary.convergence.iteration_count, mean_ratio(summary.quality_before).min,
          mean_ratio(summary.quality_after).min, mean_ratio(summary.quality_after).mean,
          1e3 * summary.times.iterate_seconds);
    }
    const MetricStats& cpu = mean_ratio(summaries[0].quality_after);
    const MetricStats& cuda = mean_ratio(summaries[1].quality_after);
    EXPECT_NEAR(cuda.mean, cpu.mean, 0.01 * cpu.mean);
    EXPECT_NEAR(cuda.min, cpu.min, 0.02 * cpu.min);
  }
};

TEST_F(CudaFarErrors, EndAsOnTheCpu) {
  for (const test::FarError& error : test::far_errors(2)) {
    expect_alike(error.name, error.mesh(), {.boundary = error.boundary}, error.least_mean_ratio);
  }
}

TEST_F(CudaFarErrors, OfFewNodesAreCuredInMeshesOfEverySize) {
  for (const int cells : {24, 36, 72}) {
    expect_alike("damaged cube of " + std::to_string(cells) + " cells",
                 formats::generate_damage({.cells = cells}).mesh, {}, 0.74);
  }
}

TEST_F(CudaFarErrors, EndInTheSameBitsOnEveryRun) {
  const Mesh mesh = test::hub(24, 30, 0).mesh();
  Mesh first = mesh, second = mesh;
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda:0");
  smoother->smooth(first, {});
  smoother->smooth(second, {});
  EXPECT_TRUE(test::same_bits(first, second));
}

}  // namespace
}  // namespace meshsmooth
