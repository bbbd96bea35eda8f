// Move on CUDA: the same outcome as on the CPU.

#include <gtest/gtest.h>

#include <cstdio>
#include <thread>
#include <vector>

#include "core/smoothing.hpp"
#include "support/cuda_device.hpp"
#include "support/kept_reference.hpp"
#include "support/mesh_size.hpp"
#include "support/motions.hpp"

namespace meshsmooth {
namespace {

class CudaMove : public test::CudaTest {
 protected:
  static SmoothSummary run(const char* backend, const test::Motion& motion,
                           const SmoothOptions& options, Mesh& mesh) {
    mesh = motion.reference;
    SmoothSummary summary = make_smoother(backend)->smooth(mesh, options, {}, motion.input());
    const MotionStats& stats = summary.motion.value();
    std::printf(
        "%s on %s: %zu nodes, reached %.4f in %d steps (%d in vain), %d iterations, %d sweeps, "
        "mean ratio %.4f, %.2f ms\n",
        motion.name.c_str(), backend, mesh.node_count(), stats.reached, stats.step_count,
        stats.rejected_step_count, stats.linear_iteration_count,
        summary.convergence.iteration_count, summary.quality_after.metrics.front().min,
        1e3 * summary.times.iterate_seconds);
    EXPECT_EQ(summary.quality_after.inverted_count, 0);
    EXPECT_EQ(summary.quality_after.degenerate_count, 0);
    return summary;
  }

  static void expect_alike(const test::Motion& motion, SmoothOptions options) {
    SCOPED_TRACE(motion.name);
    Mesh on_cpu, on_cuda, again;
    const SmoothSummary cpu = run("cpu", motion, options, on_cpu);
    const SmoothSummary cuda = run("cuda:0", motion, options, on_cuda);
    EXPECT_EQ(cuda.motion->reached, cpu.motion->reached);
    const MetricStats& expected = cpu.quality_after.metrics.front();
    EXPECT_NEAR(cuda.quality_after.metrics.front().mean, expected.mean, 0.01 * expected.mean);
    EXPECT_NEAR(cuda.quality_after.metrics.front().min, expected.min, 0.02);
    run("cuda:0", motion, options, again);
    EXPECT_TRUE(test::same_bits(on_cuda, again));
    if (cuda.motion->reached < 1) return;
    for (std::size_t n = 0; n < motion.nodes.size(); ++n) {
      const auto node = static_cast<std::size_t>(motion.nodes[n]);
      EXPECT_EQ(test::points(on_cuda)[node], motion.positions[n]);
    }
  }
};

TEST_F(CudaMove, ReachesWhatTheCpuReaches) {
  for (const double degrees : {30.0, 60.0, 90.0, 180.0}) {
    const test::Motion motion = test::turned_hub(24, degrees);
    expect_alike(motion, motion.options());
  }
  const test::Motion motions[] = {
      test::turned_hub(12, 60, 12),
      test::swollen_layer(1e-3),
      test::twisted("tetrahedra", test::unit_lattice(ElementType::tetrahedron, 12), 90),
      test::twisted("hexahedra", test::unit_lattice(ElementType::hexahedron, 12), 90),
      test::twisted("wedges", test::unit_lattice(ElementType::wedge, 8), 90),
      test::random_motion(test::unit_lattice(ElementType::triangle, 12), 5, 0.02),
      test::random_motion(test::unit_lattice(ElementType::quad, 12), 6, 0.02)};
  for (const test::Motion& motion : motions) expect_alike(motion, motion.options());
}

TEST_F(CudaMove, LetsTheEndsSlide) {
  const test::Motion motion = test::turned_cylinders(12, 45, 8);
  SmoothOptions options = motion.options();
  options.boundary = BoundaryPolicy::slide;
  expect_alike(motion, options);
}

TEST_F(CudaMove, ReturnsToTheReferenceBitForBit) {
  const test::Motion motion = test::turned_hub(16, 0, 4);
  Mesh mesh;
  run("cuda:0", motion, motion.options(), mesh);
  EXPECT_TRUE(test::same_bits(mesh, motion.reference));
}

TEST_F(CudaMove, SharesTheSystemOfAKeptReference) { test::expect_shared_systems("cuda:0"); }

TEST_F(CudaMove, StartsWarmIfAsked) { test::expect_warm_starts("cuda:0"); }

TEST_F(CudaMove, BoundsTheMemoryOfAKeptReference) { test::expect_bounded_memory("cuda:0"); }

TEST_F(CudaMove, NeedsFewIterationsOnAKeptReference) { test::expect_few_iterations("cuda:0"); }

TEST_F(CudaMove, SharesAKeptReferenceBetweenLanes) {
  const test::Motion motion = test::turned_hub(14, 45, 10);
  const MeshTopology topology(motion.reference);
  const PositionsView reference = std::span<const Vec3d>(test::points(motion.reference));
  const auto prepared = make_smoother("cuda:0")->prepare(topology.view(), {}, reference);
  constexpr int kLanes = 4, kJobs = 6;
  std::vector<Mesh> results(kLanes * kJobs, motion.reference);
  {
    std::vector<std::jthread> lanes;
    for (int lane = 0; lane < kLanes; ++lane) {
      lanes.emplace_back([&, lane] {
        const auto smoother = make_smoother("cuda:0");
        for (int n = 0; n < kJobs; ++n) {
          Mesh& result = results[static_cast<std::size_t>(lane * kJobs + n)];
          JobPositions arrays(reference, result.positions_span());
          arrays.input = motion.input();
          (void)smoother->smooth(*prepared, arrays, motion.options(), {});
        }
      });
    }
  }
  for (const Mesh& result : results) EXPECT_TRUE(test::same_bits(result, results.front()));
}

TEST_F(CudaMove, TakesNoMoreMemoryThanTheEstimate) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda:0");
  for (const test::Motion& motion :
       {test::turned_hub(40, 60, 40), test::turned_hub(200, 90),
        test::twisted("hexahedra", test::unit_lattice(ElementType::hexahedron, 40), 60)}) {
    Mesh mesh = motion.reference;
    const MemoryEstimate estimate = smoother->estimate(test::size_of(mesh), motion.options());
    EXPECT_GE(estimate.device_bytes,
              smoother->smooth(mesh, motion.options(), {}, motion.input()).device_peak_bytes)
        << motion.name;
  }
}

}  // namespace
}  // namespace meshsmooth
