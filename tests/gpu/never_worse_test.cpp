// SmoothOptions::never_worse on both backends.

#include <gtest/gtest.h>

#include "core/random_mesh.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using CudaNeverWorse = test::CudaTest;

SmoothSummary smooth_in_place(const char* backend, Mesh& mesh, const SmoothOptions& options) {
  return make_smoother(backend)->smooth(mesh, options);
}

TEST_F(CudaNeverWorse, HoldsForEveryMethodOnRandomMeshes) {
  const std::vector<test::Way> ways = test::ways(true);
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda:0");
  std::int64_t restored = 0;
  for (int seed = 0; seed < test::mesh_count() / 2; ++seed) {
    test::RandomMesh random(static_cast<unsigned>(seed));
    Mesh mesh = random.valid();
    if (random.pick(0, 2) == 0) mesh = test::wavy_if_surface(mesh);
    if (random.pick(0, 3) == 0) mesh = test::as_float32(mesh);
    if (!test::is_valid(mesh)) continue;
    const test::Way& way = ways[static_cast<std::size_t>(seed) % ways.size()];
    SmoothOptions options{
        .method = way.method, .form = way.form, .max_iterations = random.pick(1, 30)};
    if (random.pick(0, 2) == 0) options.boundary = BoundaryPolicy::slide;

    const SmoothSummary summary = smoother->smooth(mesh, options);

    restored += summary.kept_quality.value().restored_node_count();
    for (const LowerMeasure& lower : find_lower(summary)) {
      EXPECT_TRUE(lower.mean && way.name == "optimize_worst") << seed << " " << way.name;
    }
    EXPECT_EQ(summary.quality_after.inverted_count, 0) << seed << " " << way.name;
    // What is reported is what came back.
    const QualityStats found = measure_quality(mesh);
    EXPECT_NEAR(test::mean_ratio(found).min, test::mean_ratio(summary.quality_after).min, 1e-9)
        << seed << " " << way.name;
  }
  EXPECT_GT(restored, test::mesh_count() / 8);
}

/// A thin ring, three quarters of it: averaging pulls nodes across.
TEST_F(CudaNeverWorse, MovesTheSameNodesBack) {
  const Mesh mesh = test::mapped(test::lattice(ElementType::triangle, 40), [](Vec3d p) {
    const double angle = 4.7 * p.x / 40, radius = 1 + 0.8 * p.y / 40;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), 0};
  });
  const SmoothOptions options{.method = Laplacian{}};
  Mesh on_cpu = mesh, on_cuda = mesh;
  const SmoothSummary cpu = smooth_in_place("cpu", on_cpu, options);

  const SmoothSummary cuda = smooth_in_place("cuda:0", on_cuda, options);

  EXPECT_GT(cpu.kept_quality.value().restored_node_count(), 0);
  EXPECT_EQ(cuda.kept_quality.value().for_mean_ratio, cpu.kept_quality->for_mean_ratio);
  EXPECT_EQ(cuda.kept_quality->for_scaled_jacobian, cpu.kept_quality->for_scaled_jacobian);
  EXPECT_EQ(cuda.kept_quality->for_mean, cpu.kept_quality->for_mean);
  EXPECT_LT(test::difference(on_cuda, test::oracle::to_points(on_cpu)), 1e-9);
  EXPECT_EQ(cuda.nodes.moved, cpu.nodes.moved);
}

/// The result may be written before the step: with a kept topology, and where an error may leave
/// anything in the array.
TEST_F(CudaNeverWorse, WritesTheResultAgainThatWentBack) {
  const Mesh mesh = test::mapped(test::lattice(ElementType::triangle, 9), [](Vec3d p) {
    const double angle = 4.7 * p.x / 9, radius = 1 + 0.8 * p.y / 9;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), 0};
  });
  const SmoothOptions options{.method = Laplacian{}};
  Mesh expected = mesh, early = mesh;
  smooth_in_place("cuda:0", expected, options);
  const MeshTopology topology(early);
  JobPositions positions(early.positions_span());
  positions.kept_on_error = false;

  const SmoothSummary summary =
      make_smoother("cuda:0")->smooth(topology.view(), positions, options, {});

  EXPECT_GT(summary.kept_quality.value().restored_node_count(), 0);
  EXPECT_TRUE(test::same_bits(early, expected));
}

}  // namespace
}  // namespace meshsmooth
