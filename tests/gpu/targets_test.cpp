// What elements aim at, and validity between corners, on both backends.

#include <gtest/gtest.h>

#include <cstdio>

#include "core/layers.hpp"
#include "core/promises.hpp"
#include "support/cuda_device.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

using formats::LayerElements;
using test::Job;

class CudaTargets : public test::CudaTest {
 protected:
  static Job on(const char* backend, const Mesh& mesh, const SmoothOptions& options,
                const JobInput& input = {}) {
    return test::smooth_on(*make_smoother(backend), mesh, options, input);
  }
  static const MetricStats& jacobian(const Job& job) {
    return test::scaled_jacobian(job.summary.quality_after);
  }
  static void print(const std::string& name, const Job& job) {
    std::printf(
        "%s on %s: %lld inverted to %lld, %d sweeps, scaled Jacobian %.6f, mean %.6f, %.2f ms\n",
        name.c_str(), job.summary.backend.c_str(),
        static_cast<long long>(job.summary.quality_before.inverted_count),
        static_cast<long long>(job.summary.quality_after.inverted_count),
        job.summary.convergence.iteration_count, jacobian(job).min, jacobian(job).mean,
        1e3 * job.summary.times.iterate_seconds);
  }
  /// Smooths on both and compares what they end in; gives the result of CUDA.
  static Job expect_alike(const std::string& name, const Mesh& mesh, const SmoothOptions& options,
                          const JobInput& input = {}) {
    SCOPED_TRACE(name);
    const Job cpu = on("cpu", mesh, options, input);
    Job cuda = on("cuda:0", mesh, options, input);
    for (const Job* job : {&cpu, static_cast<const Job*>(&cuda)}) {
      print(name, *job);
      EXPECT_EQ(job->summary.quality_after.inverted_count, 0);
      EXPECT_EQ(job->summary.quality_after.degenerate_count, 0);
    }
    EXPECT_EQ(cuda.summary.quality_before.inverted_count,
              cpu.summary.quality_before.inverted_count);
    EXPECT_EQ(cuda.summary.nodes.outside_only_below, cpu.summary.nodes.outside_only_below);
    EXPECT_EQ(cuda.summary.flat_reference_element_count, cpu.summary.flat_reference_element_count);
    const double mean = jacobian(cpu).mean;
    EXPECT_NEAR(jacobian(cuda).mean, mean, 0.01 * mean);
    return cuda;
  }
};

TEST_F(CudaTargets, LeaveAPerfectLayerBitForBit) {
  for (const test::LayerCase& c :
       test::layer_cases({LayerElements::hexahedra, LayerElements::wedges, LayerElements::quads})) {
    const Mesh mesh = c.mesh();
    EXPECT_TRUE(test::same_bits(on("cuda:0", mesh, {}).mesh, mesh)) << c.name();
  }
}

TEST_F(CudaTargets, StraightenAJitteredLayer) {
  const auto smoother = make_smoother("cuda:0");
  for (const test::LayerCase& c : test::layer_cases({LayerElements::hexahedra})) {
    const Job job = test::expect_straightened(*smoother, c);
    print("jittered " + c.name(), job);
    std::printf("  mean first height %.4f of what it was\n",
                test::first_height(job.mesh, c.mesh(), c.first) / c.first);
  }
}

TEST_F(CudaTargets, AreIdealWithoutAMeantAspectRatio) {
  const auto smoother = make_smoother("cuda:0");
  for (const int cells : {8, 12, 20}) {
    for (const auto& [name, mesh] : test::isotropic_hexahedra(cells)) {
      print(name, test::expect_as_good_as_ideal(*smoother, name, mesh, 1e-4));
    }
  }
}

TEST_F(CudaTargets, BringAJitteredLayerBackToItsReference) {
  for (const LayerElements type :
       {LayerElements::hexahedra, LayerElements::wedges, LayerElements::tetrahedra}) {
    formats::LayerOptions options{.elements = type, .first = 1e-4, .growth = 1.25};
    const Mesh clean = formats::generate_layer(options).mesh;
    options.jitter = 0.3;
    const Mesh jittered = formats::generate_layer(options).mesh;
    const Job job =
        expect_alike("jittered layer " + std::to_string(static_cast<int>(type)) + " by reference",
                     jittered, {}, {.reference = clean.positions_view()});
    if (type == LayerElements::hexahedra) {
      EXPECT_GE(jacobian(job).min, 0.99);
      expect_alike("jittered layer by itself", jittered, {});
    }
    expect_alike("in float32", test::as_float32(jittered), {},
                 {.reference = clean.positions_view()});
  }
}

TEST_F(CudaTargets, KeepTheLayerOnATangledCore) {
  for (const LayerElements type : {LayerElements::hexahedra, LayerElements::wedges}) {
    formats::LayerOptions options{.elements = type, .core = 12, .tangle = 0.3};
    expect_alike("layer on a tangled core", formats::generate_layer(options).mesh, {});
  }
}

TEST_F(CudaTargets, TellWhatSlidesWhere) {
  for (const int rows : {24, 48}) {
    const Mesh clean = test::with_fixed_set(formats::generate_hub({.rows = rows, .layers = rows}));
    const Mesh turned =
        test::with_fixed_set(formats::generate_hub({.rows = rows, .degrees = 30, .layers = rows}));
    expect_alike("hub of " + std::to_string(rows) + " rows and layers", turned,
                 {.boundary = BoundaryPolicy::slide}, {.reference = clean.positions_view()});
  }
}

TEST_F(CudaTargets, PoorElementsAreCountedAsOnTheCpu) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 12), 0.25, 6);
  const SmoothOptions options{
      .max_iterations = 200, .tolerance = {.value = 1e-9}, .report_below = 0.9};
  const PoorElements cpu = on("cpu", mesh, options).summary.poor.value();
  const PoorElements gpu = on("cuda:0", mesh, options).summary.poor.value();
  EXPECT_GT(cpu.limited_count, 0);
  const auto count = static_cast<double>(cpu.element_count);
  EXPECT_NEAR(static_cast<double>(gpu.element_count), count, 0.01 * count);
  EXPECT_EQ(gpu.locked_count, cpu.locked_count);
  EXPECT_EQ(gpu.limited_count + gpu.locked_count, gpu.element_count);
}

TEST_F(CudaTargets, AnchorsFlatReferencesAndBadElementsAreAsOnTheCpu) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 12), 0.2, 6);
  expect_alike("anchored", mesh, {.method = Optimize{.stay = 1}});
  expect_alike("bad elements", mesh, {.only_below = OnlyBelow{.quality = 0.4, .rings = 1}});
  Mesh reference = mesh;
  test::points(reference)[mesh.node_count() / 2] += Vec3d{40, 0, 0};
  expect_alike("partly flat reference", mesh, {}, {.reference = reference.positions_view()});
}

TEST_F(CudaTargets, LeaveNoElementInvalidBetweenItsCorners) {
  for (const ElementType type :
       {ElementType::hexahedron, ElementType::wedge, ElementType::pyramid}) {
    expect_alike("tangled " + std::string(element_name(type)),
                 test::noisy(test::lattice(type, 20), 0.45, 5), {});
  }
}

/// On one with 200,000 hexahedra too, 30 % of them tangled.
TEST_F(CudaTargets, UntangleAHexahedralMesh) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::hexahedron, 58), 0.62, 5);
  const Job job = expect_alike("tangled block", mesh, {});
  EXPECT_GT(job.summary.quality_before.inverted_count,
            static_cast<std::int64_t>(mesh.element_count()) / 5);
}

}  // namespace
}  // namespace meshsmooth
