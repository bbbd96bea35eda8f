#pragma once

// Motions on a reference that is kept with its topology, for both backends.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/smoothing.hpp"
#include "generate/generate.hpp"
#include "support/mesh_size.hpp"
#include "support/motions.hpp"
#include "support/oracle.hpp"

namespace meshsmooth::test {

class KeptReference {
 public:
  KeptReference(std::string_view backend, const Mesh& reference, int threads = 2)
      : smoother_(make_smoother(backend, threads)),
        mesh_(reference),
        topology_(mesh_),
        prepared_(smoother_->prepare(topology_.view(), {}, positions())) {}

  [[nodiscard]] PositionsView positions() const { return std::span<const Vec3d>(points(mesh_)); }

  /// Moves it. What the result's positions are before does not count.
  Job move(const Motion& motion, const SmoothOptions& options) {
    Job job{mesh_, {}};
    std::ranges::fill(std::get<std::vector<Vec3d>>(job.mesh.positions), Vec3d{7, 7, 7});
    JobPositions arrays(positions(), job.mesh.positions_span());
    arrays.input = motion.input();
    job.summary = smoother_->smooth(*prepared_, arrays, options, {});
    return job;
  }
  Job move(const Motion& motion) { return move(motion, motion.options()); }
  [[nodiscard]] MemoryEstimate kept_bytes() const { return prepared_->bytes(); }
  [[nodiscard]] MeshSize size() const {
    MeshSize size = size_of(mesh_);
    size.reference = true;
    return size;
  }
  [[nodiscard]] Smoother& smoother() { return *smoother_; }

 private:
  std::unique_ptr<Smoother> smoother_;
  Mesh mesh_;
  MeshTopology topology_;
  std::shared_ptr<const PreparedTopology> prepared_;
};

inline double least_mean_ratio(const QualityStats& quality) { return quality.metrics.front().min; }

/// Jobs share a system, build another one for other fixed nodes, and have the same bits whichever
/// came first, on any number of threads.
inline void expect_shared_systems(std::string_view backend) {
  const Motion motion = turned_hub(14, 45, 10), other = turned_cylinders(14, 45, 10);
  const Job bare =
      smooth_on(*make_smoother(backend), motion.reference, motion.options(), motion.input());
  KeptReference kept(backend, motion.reference);
  const Job first = kept.move(motion);
  EXPECT_EQ(first.summary.motion->reached, 1);
  EXPECT_EQ(first.summary.nodes.moved, bare.summary.nodes.moved);
  EXPECT_NEAR(least_mean_ratio(first.summary.quality_after),
              least_mean_ratio(bare.summary.quality_after), 0.01);
  EXPECT_EQ(least_mean_ratio(first.summary.quality_before),
            least_mean_ratio(bare.summary.quality_before));
  EXPECT_TRUE(same_bits(first.mesh, kept.move(motion).mesh));

  SmoothOptions slides = other.options();
  slides.boundary = BoundaryPolicy::slide;
  const Job slid = kept.move(other, slides);
  EXPECT_EQ(slid.summary.motion->reached, 1);
  EXPECT_EQ(slid.summary.quality_after.inverted_count, 0);
  EXPECT_TRUE(same_bits(slid.mesh, kept.move(other, slides).mesh));
  EXPECT_TRUE(same_bits(first.mesh, kept.move(motion).mesh));
  KeptReference again(backend, motion.reference, 5);
  EXPECT_TRUE(same_bits(slid.mesh, again.move(other, slides).mesh));
  EXPECT_TRUE(same_bits(first.mesh, again.move(motion).mesh));
}

inline void expect_bounded_memory(std::string_view backend) {
  for (const Motion& motion :
       {turned_hub(24, 30, 20), turned_hub(100, 30),
        twisted("tetrahedra", unit_lattice(ElementType::tetrahedron, 24), 20),
        twisted("hexahedra", unit_lattice(ElementType::hexahedron, 24), 20)}) {
    SCOPED_TRACE(motion.name);
    KeptReference kept(backend, motion.reference);
    const MemoryEstimate estimate = kept.smoother().estimate(kept.size(), motion.options());
    const MemoryEstimate most = kept.smoother().estimate_prepared(kept.size());
    for (int n = 0; n < 2; ++n) {
      const SmoothSummary summary = kept.move(motion).summary;
      EXPECT_GE(estimate.host_bytes, summary.host_peak_bytes);
      EXPECT_GE(estimate.device_bytes, summary.device_peak_bytes);
      EXPECT_GE(most.host_bytes, kept.kept_bytes().host_bytes);
      EXPECT_GE(most.device_bytes, kept.kept_bytes().device_bytes);
      EXPECT_LE(summary.motion->linear_iteration_count, 12);
    }
  }
}

/// Iterations do not grow with the mesh, its layers' aspect ratio or its slivers.
inline void expect_few_iterations(std::string_view backend) {
  for (const Motion& motion :
       {turned_hub(12, 30, 12), turned_hub(30, 30, 24), turned_hub(160, 30), swollen_layer(1e-3),
        swollen_layer(1e-5), twisted("slivers", formats::generate_cube(20'000, 1), 10)}) {
    SCOPED_TRACE(motion.name);
    KeptReference kept(backend, motion.reference);
    SmoothOptions options = motion.options();
    options.max_iterations = 0;
    const SmoothSummary summary = kept.move(motion, options).summary;
    EXPECT_LE(summary.motion->linear_iteration_count, 12);
    EXPECT_LE(summary.motion->linear_residual, 1e-4);
  }
}

/// Small steps go on from where the last ones lead to; cold ones know nothing of them.
inline void expect_warm_starts(std::string_view backend) {
  const auto motion_to = [](double degrees) { return turned_hub(20, degrees, 16); };
  KeptReference kept(backend, motion_to(0).reference);
  const Motion last = motion_to(12);
  const Job cold = kept.move(last);
  for (int step = 1; step <= 5; ++step) {
    const Motion motion = motion_to(9 + 0.5 * step);
    const MotionStats stats =
        *kept.move(motion, motion.options({.start = Start::warm})).summary.motion;
    EXPECT_EQ(stats.reached, 1);
    EXPECT_LE(stats.linear_residual, 1e-4);
    if (step > 2) {
      EXPECT_LE(stats.linear_iteration_count, 1);
    }
  }
  const Job warm = kept.move(last, last.options({.start = Start::warm}));
  EXPECT_LT(warm.summary.motion->linear_iteration_count,
            cold.summary.motion->linear_iteration_count);
  EXPECT_LT(oracle::max_distance(oracle::to_points(warm.mesh), oracle::to_points(cold.mesh)), 1e-3);
  EXPECT_TRUE(same_bits(kept.move(last).mesh, cold.mesh));
  // Not where they lead to.
  const Motion turned_back = motion_to(-30);
  const SmoothSummary back =
      kept.move(turned_back, turned_back.options({.start = Start::warm})).summary;
  EXPECT_EQ(back.motion->reached, 1);
  EXPECT_LE(back.motion->linear_residual, 1e-4);
}

}  // namespace meshsmooth::test
