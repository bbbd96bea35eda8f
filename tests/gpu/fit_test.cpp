// Target surfaces on CUDA: what the CPU reaches is reached, in the same bits every time.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "core/fit_cases.hpp"
#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/cuda_device.hpp"
#include "support/mesh_size.hpp"

namespace meshsmooth {
namespace {

using test::box_mesh;
using test::box_surface;
using test::Job;
using test::on;
using test::sliding;

struct FitCase {
  std::string name;
  Mesh mesh;
  SurfaceMesh surface;
  bool all_reached = true;
};

std::vector<FitCase> fit_cases() {
  std::vector<FitCase> cases;
  for (const ElementType type : {ElementType::hexahedron, ElementType::tetrahedron,
                                 ElementType::wedge, ElementType::pyramid}) {
    cases.push_back({"box of " + std::string(element_name(type)), box_mesh(type, 5, 0.03, 0.95),
                     box_surface(3, {1, 1, 1})});
  }
  cases.push_back({"L", test::l_mesh(4), test::l_surface(4)});
  cases.push_back(
      {"sphere", box_mesh(ElementType::hexahedron, 12, -0.7, 0.7), test::sphere_surface(24, 1)});
  cases.push_back({"on it", test::thrown_box_mesh(), box_surface(2, {1, 1, 1})});
  cases.push_back({"sphere with a hole", box_mesh(ElementType::hexahedron, 5, -0.6, 0.6),
                   test::sphere_with_hole(), false});
  cases.push_back(
      {"folded", box_mesh(ElementType::hexahedron, 6, 0.03, 0.95), test::folded_surface(), false});
  return cases;
}

class CudaFit : public test::CudaTest {};

TEST_F(CudaFit, ReachesWhatTheCpuReaches) {
  const auto cpu = make_smoother("cpu"), cuda = make_smoother("cuda:0");
  for (const FitCase& c : fit_cases()) {
    for (const Mesh& mesh : {c.mesh, test::as_float32(c.mesh)}) {
      const bool float64 = mesh.positions.index() == 1;
      SCOPED_TRACE(c.name + (float64 ? ", float64" : ", float32"));
      SmoothOptions options = sliding();
      options.max_iterations = 100;
      const Job a = test::smooth_on(*cpu, mesh, options, on(c.surface));
      const Job b = test::smooth_on(*cuda, mesh, options, on(c.surface));
      ASSERT_TRUE(a.summary.fit && b.summary.fit);
      const FitStats &x = *a.summary.fit, &y = *b.summary.fit;
      std::printf("%s: %lld of %lld nodes, on the CPU %lld; scaled Jacobian %.4f, %.4f\n",
                  c.name.c_str(), static_cast<long long>(y.reached_count),
                  static_cast<long long>(y.node_count), static_cast<long long>(x.reached_count),
                  test::scaled_jacobian(b.summary.quality_after).min,
                  test::scaled_jacobian(a.summary.quality_after).min);
      EXPECT_EQ(b.summary.quality_after.inverted_count, 0);
      EXPECT_EQ(y.node_count, x.node_count);
      EXPECT_EQ(y.fixed_count, x.fixed_count);
      EXPECT_EQ(y.surface.patches, x.surface.patches);
      EXPECT_EQ(y.surface.curves, x.surface.curves);
      EXPECT_EQ(y.reached_count + y.held_count, y.node_count);
      EXPECT_EQ(y.input_off_surface, x.input_off_surface);
      if (!c.all_reached) continue;
      EXPECT_EQ(y.held_count, x.held_count);
      EXPECT_LT(y.result_to_surface.largest, float64 ? 1e-12 : 1e-6);
      const double mean = test::scaled_jacobian(a.summary.quality_after).mean;
      EXPECT_NEAR(test::scaled_jacobian(b.summary.quality_after).mean, mean, 0.01 * mean);
    }
  }
}

TEST_F(CudaFit, GivesTheSameBitsEveryTime) {
  const auto smoother = make_smoother("cuda:0"), other = make_smoother("cuda:0");
  for (const FitCase& c : fit_cases()) {
    const Job first = test::smooth_on(*smoother, c.mesh, sliding(), on(c.surface));
    for (int run = 0; run < 3; ++run) {
      EXPECT_TRUE(test::same_bits(test::smooth_on(*other, c.mesh, sliding(), on(c.surface)).mesh,
                                  first.mesh))
          << c.name;
    }
  }
}

TEST_F(CudaFit, InvertsNoElementThatWasValidWhereOthersStayInverted) {
  const auto smoother = make_smoother("cuda:0");
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  for (const ElementType type : {ElementType::hexahedron, ElementType::tetrahedron}) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      const Mesh mesh = test::tangled_box_mesh(type, seed);
      const Job job = test::smooth_on(*smoother, mesh, sliding(), on(surface));
      ASSERT_GT(job.summary.quality_after.inverted_count, 0);
      EXPECT_TRUE(test::keeps_valid_elements(mesh, job.mesh)) << element_name(type) << ", " << seed;
    }
  }
}

TEST_F(CudaFit, OfAKeptTopologyIsThatOfABareOne) {
  const auto smoother = make_smoother("cuda:0");
  const FitCase c = fit_cases().front();
  const MeshTopology topology(c.mesh);
  const auto prepared = smoother->prepare(topology.view(), {}, {});
  Mesh mesh = c.mesh;
  JobPositions positions(mesh.positions_span());
  positions.input = on(c.surface);
  const SmoothSummary summary = smoother->smooth(*prepared, positions, sliding(), {});
  ASSERT_TRUE(summary.fit);
  EXPECT_EQ(summary.fit->held_count, 0);
  EXPECT_EQ(summary.quality_after.inverted_count, 0);
}

TEST_F(CudaFit, TakesNoMoreThanTheEstimate) {
  const auto smoother = make_smoother("cuda:0");
  for (const ElementType type : {ElementType::hexahedron, ElementType::tetrahedron}) {
    const Mesh mesh = box_mesh(type, type == ElementType::hexahedron ? 47 : 37, 0.01, 0.99);
    for (const int squares : {5, 60}) {
      const SurfaceMesh surface = box_surface(squares, {1, 1, 1});
      for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
        SCOPED_TRACE(std::string(element_name(type)) + ", " + std::to_string(squares));
        SmoothOptions options = sliding();
        options.max_iterations = 10;
        const std::int64_t estimate =
            smoother->estimate(test::size_of(start, on(surface)), options).device_bytes;
        const Job job = test::smooth_on(*smoother, start, options, on(surface));
        const double peak = static_cast<double>(job.summary.device_peak_bytes);
        std::printf("%s: estimate / peak %.3f, iterate %.1f ms\n", element_name(type).data(),
                    static_cast<double>(estimate) / peak, 1e3 * job.summary.times.iterate_seconds);
        EXPECT_GE(static_cast<double>(estimate), peak);
        EXPECT_LE(static_cast<double>(estimate), 1.5 * peak);
      }
    }
  }
}

TEST_F(CudaFit, RaisesTheLeastScaledJacobianAsTheCpuDoes) {
  const auto cpu = make_smoother("cpu"), cuda = make_smoother("cuda:0");
  SmoothOptions options = sliding();
  options.method = Optimize{Goal::worst};
  for (const FitCase& c : fit_cases()) {
    if (!c.all_reached) continue;
    options.metric = QualityMetric::mean_ratio;
    const Job plain = test::smooth_on(*cuda, c.mesh, options, on(c.surface));
    options.metric = QualityMetric::scaled_jacobian;
    const Job a = test::smooth_on(*cpu, c.mesh, options, on(c.surface));
    const Job b = test::smooth_on(*cuda, c.mesh, options, on(c.surface));
    const auto least = [](const Job& job) {
      return test::scaled_jacobian(job.summary.quality_after).min;
    };
    std::printf("%s: %.4f, on the CPU %.4f, without %.4f; iterate %.1f ms, without %.1f ms\n",
                c.name.c_str(), least(b), least(a), least(plain),
                1e3 * b.summary.times.iterate_seconds, 1e3 * plain.summary.times.iterate_seconds);
    EXPECT_EQ(b.summary.quality_after.inverted_count, 0) << c.name;
    EXPECT_GE(least(b), least(plain) - 1e-9) << c.name;
    EXPECT_NEAR(least(b), least(a), 0.05) << c.name;
    EXPECT_TRUE(
        test::same_bits(test::smooth_on(*cuda, c.mesh, options, on(c.surface)).mesh, b.mesh))
        << c.name;
  }
}

TEST_F(CudaFit, RefusesWhatItIsNotFor) {
  const auto smoother = make_smoother("cuda:0");
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  Mesh quads = test::lattice(ElementType::quad, 3);
  EXPECT_THROW(smoother->smooth(quads, sliding(), {}, on(surface)), NotSupported);
}

}  // namespace
}  // namespace meshsmooth
