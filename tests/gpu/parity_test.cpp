// The CUDA backend's results are the CPU backend's, and the same on every run.

#include <gmock/gmock.h>

#include <iostream>
#include <thread>

#include "core/smoothing.hpp"
#include "generate/generate.hpp"
#include "gpu/gpu_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/surfaces.hpp"

namespace meshsmooth {
namespace {

using test::Job;
using test::same_bits;
using test::smooth_on;
using test::oracle::to_points;

bool is_double(const Mesh& mesh) {
  return std::holds_alternative<std::vector<Vec3d>>(mesh.positions);
}

/// Roots and angles come from another library on a device: the last bits differ.
void expect_close(double told, double truth) {
  EXPECT_NEAR(told, truth, 1e-9 * std::max(1.0, std::abs(truth)));
}

void expect_equal(const QualityStats& told, const QualityStats& truth) {
  EXPECT_EQ(told.element_count, truth.element_count);
  EXPECT_EQ(told.inverted_count, truth.inverted_count);
  EXPECT_EQ(told.degenerate_count, truth.degenerate_count);
  expect_close(told.sum_absolute_volume, truth.sum_absolute_volume);
  expect_close(told.enclosed_volume, truth.enclosed_volume);
  ASSERT_EQ(told.metrics.size(), truth.metrics.size());
  for (std::size_t m = 0; m < told.metrics.size(); ++m) {
    const MetricStats& a = told.metrics[m];
    const MetricStats& b = truth.metrics[m];
    EXPECT_EQ(a.metric, b.metric);
    EXPECT_EQ(a.element_count, b.element_count);
    expect_close(a.min, b.min);
    expect_close(a.mean, b.mean);
    expect_close(a.max, b.max);
    EXPECT_EQ(a.histogram_lower, b.histogram_lower);
    EXPECT_EQ(a.histogram_upper, b.histogram_upper);
    // It is the edge of a bin; a value on the edge may fall on either side.
    EXPECT_NEAR(a.percentile_1, b.percentile_1,
                1.001 * (b.histogram_upper - b.histogram_lower) / 2048)
        << metric_name(b.metric);
    std::int64_t sum_told = 0, sum_truth = 0;
    ASSERT_EQ(a.histogram.size(), b.histogram.size());
    for (std::size_t bin = 0; bin < a.histogram.size(); ++bin) {
      sum_told += a.histogram[bin];
      sum_truth += b.histogram[bin];
    }
    EXPECT_EQ(sum_told, sum_truth);
  }
  ASSERT_EQ(told.worst.size(), truth.worst.size());
  for (std::size_t w = 0; w < told.worst.size(); ++w) {
    expect_close(told.worst[w].mean_ratio, truth.worst[w].mean_ratio);
    // Elements that are equally bad but for the last bits may change places.
    if (told.worst[w].element == truth.worst[w].element) {
      expect_close(told.worst[w].scaled_jacobian, truth.worst[w].scaled_jacobian);
    }
  }
}

void expect_equal(const Convergence& told, const Convergence& truth) {
  const double near = 1e-12 * truth.bounding_box_diagonal;
  EXPECT_EQ(told.iteration_count, truth.iteration_count);
  EXPECT_NEAR(told.last_max_displacement, truth.last_max_displacement, near);
  EXPECT_NEAR(told.last_rms_displacement, truth.last_rms_displacement, near);
  EXPECT_NEAR(told.tolerance, truth.tolerance, near);
  EXPECT_NEAR(told.bounding_box_diagonal, truth.bounding_box_diagonal, near);
  EXPECT_EQ(told.held_node_count, truth.held_node_count);
  EXPECT_EQ(told.moved_node_counts, truth.moved_node_counts);
  ASSERT_EQ(told.max_displacements.size(), truth.max_displacements.size());
  ASSERT_EQ(told.rms_displacements.size(), truth.rms_displacements.size());
  for (std::size_t i = 0; i < truth.max_displacements.size(); ++i) {
    EXPECT_NEAR(told.max_displacements[i], truth.max_displacements[i], near);
    EXPECT_NEAR(told.rms_displacements[i], truth.rms_displacements[i], near);
  }
}

void expect_equal(const SmoothSummary& told, const SmoothSummary& truth) {
  EXPECT_EQ(told.stop_reason, truth.stop_reason);
  expect_equal(told.convergence, truth.convergence);
  expect_equal(told.quality_before, truth.quality_before);
  expect_equal(told.quality_after, truth.quality_after);
  EXPECT_EQ(told.locked.element_count, truth.locked.element_count);
  EXPECT_EQ(told.locked.inverted_count, truth.locked.inverted_count);
  ASSERT_EQ(told.locked.worst.has_value(), truth.locked.worst.has_value());
  if (truth.locked.worst) {
    expect_close(told.locked.worst->mean_ratio, truth.locked.worst->mean_ratio);
  }
  EXPECT_EQ(told.nodes.total, truth.nodes.total);
  EXPECT_EQ(told.nodes.boundary, truth.nodes.boundary);
  EXPECT_EQ(told.nodes.fixed, truth.nodes.fixed);
  EXPECT_EQ(told.nodes.isolated, truth.nodes.isolated);
  EXPECT_EQ(told.nodes.moved, truth.nodes.moved);
  EXPECT_EQ(told.nodes.sliding_in_plane, truth.nodes.sliding_in_plane);
  EXPECT_EQ(told.nodes.sliding_on_line, truth.nodes.sliding_on_line);
  EXPECT_EQ(told.nodes.sliding_on_surface, truth.nodes.sliding_on_surface);
  EXPECT_EQ(told.nodes.sliding_on_curve, truth.nodes.sliding_on_curve);
  EXPECT_EQ(told.nodes.curved, truth.nodes.curved);
  EXPECT_LE(told.deviation.result_to_input, truth.deviation.tolerance);
  expect_close(told.deviation.input_to_result, truth.deviation.input_to_result);
  EXPECT_EQ(told.colour_count, truth.colour_count);
}

/// Compares the backends job by job, and says at the end of how many the positions
/// are the same to the last bit. That is for the reader: no promise rests on it.
class Comparison {
 public:
  explicit Comparison(std::string what) : what_(std::move(what)) {}
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;
  ~Comparison() {
    std::cout << "bits: " << what_ << ": " << same_bits_count_ << " of " << job_count_
              << " jobs equal the CPU's to the last bit" << std::endl;
  }

  void run(const std::string& name, const Mesh& mesh, const SmoothOptions& options) {
    SCOPED_TRACE(name + (mesh.positions.index() == 1 ? ", float64" : ", float32") +
                 (options.guard ? ", guarded" : ", bare"));
    const Job expected = smooth_on(*cpu_, mesh, options);

    const Job job = smooth_on(*cuda_, mesh, options);

    // A team sums a ball in another order, and may fuse: while a mesh is tangled that grows.
    const bool optimized = std::holds_alternative<Optimize>(options.method);
    const double near = mesh.positions.index() != 1 ? 1e-6 : optimized ? 1e-10 : 1e-12;
    EXPECT_LE(test::difference(job.mesh, to_points(expected.mesh)), near);
    expect_equal(job.summary, expected.summary);
    ++job_count_;
    same_bits_count_ += same_bits(job.mesh, expected.mesh) ? 1 : 0;
  }

 private:
  std::string what_;
  std::unique_ptr<Smoother> cpu_ = make_smoother("cpu", 2);
  std::unique_ptr<Smoother> cuda_ = make_smoother("cuda");
  int job_count_ = 0;
  int same_bits_count_ = 0;
};

// --- every method in every form -------------------------------------------------

class EveryWay : public test::CudaTest, public testing::WithParamInterface<test::Way> {
 protected:
  [[nodiscard]] SmoothOptions options(int count, bool guard) const {
    SmoothOptions how = test::sweeps(count, GetParam().method, GetParam().form);
    how.guard = guard;
    return how;
  }
};
INSTANTIATE_TEST_SUITE_P(Cuda, EveryWay, testing::ValuesIn(test::ways(false)), test::way_name);

TEST_P(EveryWay, EqualsTheCpuBackendOnTinyMeshes) {
  Comparison comparison(GetParam().name + ", tiny meshes");
  for (const auto& [name, mesh] : test::tiny_meshes()) {
    for (const bool guard : {false, true}) {
      for (const bool history : {false, true}) {  // sweeps in batches; one by one
        SmoothOptions how = options(7, guard);
        how.history = history;
        comparison.run(name, mesh, how);
        comparison.run(name, test::as_float32(mesh), how);
      }
    }
  }
}

TEST_P(EveryWay, EqualsTheCpuBackendOnSmallMeshes) {
  Comparison comparison(GetParam().name + ", small meshes");
  for (const auto& [name, mesh] : test::small_meshes()) {
    for (const bool guard : {false, true}) {
      comparison.run(name, mesh, options(15, guard));
      comparison.run(name, test::as_float32(mesh), options(15, guard));
    }
  }
}

TEST_P(EveryWay, SlidesAsTheCpuBackendDoes) {
  Comparison comparison(GetParam().name + ", sliding");
  for (const auto& [name, mesh] : test::small_meshes()) {
    for (const bool guard : {false, true}) {
      SmoothOptions how = options(6, guard);
      how.boundary = BoundaryPolicy::slide;
      comparison.run(name, mesh, how);
      comparison.run(name, test::as_float32(mesh), how);
    }
  }
}

TEST_P(EveryWay, ConvergesAfterAsManySweepsAsTheCpuBackend) {
  Comparison comparison(GetParam().name + ", until converged");
  for (const auto& [name, mesh] : test::tiny_meshes()) {
    SmoothOptions how = options(2000, true);
    how.tolerance = {1e-3};
    comparison.run(name, mesh, how);
    how.boundary = BoundaryPolicy::free;
    how.tolerance = {1e-2};
    comparison.run(name + " with a free boundary", mesh, how);
  }
}

TEST_P(EveryWay, EndsAtTheSweepAtWhichTheCpuBackendEnds) {
  // Without the guard a device ends sweeps by itself; in float it does so late, and goes back.
  Comparison comparison(GetParam().name + ", about the last sweep");
  for (const Mesh& start : {test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.2, 3),
                            test::noisy(test::lattice(ElementType::triangle, 31), 0.2, 3)}) {
    for (const Mesh& mesh : {start, test::as_float32(start)}) {
      SmoothOptions how = options(2000, false);
      how.tolerance = {1e-3};
      const int last = test::smooth(mesh, how).summary.convergence.iteration_count;
      for (const int most : {1, 2, std::max(last - 1, 1), last, last + 1, 2000}) {
        how.max_iterations = most;
        comparison.run("at most " + std::to_string(most), mesh, how);
      }
      how = options(130, false);  // more than a batch, and nothing ends it
      how.tolerance = {0};
      comparison.run("130 sweeps", mesh, how);
    }
  }
}

TEST_P(EveryWay, OnlyEvaluatesWithoutIterations) {
  Comparison comparison(GetParam().name + ", no sweep");
  for (const auto& [name, mesh] : test::tiny_meshes()) {
    comparison.run(name, mesh, options(0, true));
  }
}

TEST_P(EveryWay, GivesTheSameBitsOnTwentyRuns) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const Mesh& mesh : {test::noisy(test::lattice(ElementType::tetrahedron, 23), 0.2, 3),
                           test::as_float32(test::noisy(test::mixed_stack(31), 0.2, 4)),
                           test::as_float32(test::noisy(test::sphere(6), 0.01, 4))}) {
    const SmoothOptions how = options(6, GetParam().form != Form::jacobi || is_double(mesh));
    const Job expected = smooth_on(*smoother, mesh, how);
    for (int run = 1; run < 20; ++run) {
      // What another job leaves in memory must not matter.
      smooth_on(*smoother, test::noisy(test::lattice(ElementType::quad, 11 + run), 0.1, 1), how);

      const Job job = smooth_on(*smoother, mesh, how);

      ASSERT_TRUE(same_bits(job.mesh, expected.mesh)) << "run " << run;
      ASSERT_EQ(job.summary.convergence.last_rms_displacement,
                expected.summary.convergence.last_rms_displacement);
      ASSERT_EQ(job.summary.quality_after.metrics[0].mean,
                expected.summary.quality_after.metrics[0].mean);
      ASSERT_EQ(job.summary.quality_after.sum_absolute_volume,
                expected.summary.quality_after.sum_absolute_volume);
    }
  }
}

TEST_P(EveryWay, GivesTheSameBitsInEightThreadsAtOnce) {
  std::vector<Mesh> meshes;
  for (const int n : {9, 13, 17, 23}) {
    meshes.push_back(test::noisy(test::lattice(ElementType::tetrahedron, n), 0.2, 3));
    meshes.push_back(test::as_float32(test::noisy(test::mixed_stack(n), 0.2, 4)));
  }
  const auto how = [&](const Mesh& mesh) {
    return options(6, GetParam().form != Form::jacobi || is_double(mesh));
  };
  std::vector<Mesh> expected;
  const std::unique_ptr<Smoother> alone = make_smoother("cuda");
  for (const Mesh& mesh : meshes) expected.push_back(smooth_on(*alone, mesh, how(mesh)).mesh);

  std::vector<std::thread> lanes;
  for (std::size_t lane = 0; lane < 8; ++lane) {
    lanes.emplace_back([&, lane] {
      const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
      for (std::size_t turn = 0; turn < 2 * meshes.size(); ++turn) {
        const std::size_t which = (lane + turn) % meshes.size();

        const Job job = smooth_on(*smoother, meshes[which], how(meshes[which]));

        EXPECT_TRUE(same_bits(job.mesh, expected[which])) << "lane " << lane << ", turn " << turn;
      }
    });
  }
  for (std::thread& lane : lanes) lane.join();
}

class GuardedSweeps : public test::CudaTest, public testing::WithParamInterface<Method> {};
INSTANTIATE_TEST_SUITE_P(Cuda, GuardedSweeps, testing::Values(Laplacian{}, Taubin{}, HcLaplacian{}),
                         [](const auto& test) { return std::string(method_name(test.param)); });

TEST_P(GuardedSweeps, EqualTheCpuBackendWhereManyMovesAreCut) {
  Comparison comparison(std::string(method_name(GetParam())) + ", many moves cut");
  const Mesh start = formats::generate_cube(9'000, 1);  // slivers, which averaging would invert
  for (const Mesh& mesh : {start, test::as_float32(start)}) {
    for (const int count : {1, 2, 3, 20}) {
      SmoothOptions how = test::sweeps(count, GetParam(), Form::jacobi);
      how.guard = true;
      comparison.run(std::to_string(count) + " sweeps", mesh, how);
      const Job job = test::smooth(mesh, how);
      EXPECT_GT(job.summary.convergence.held_node_count, job.summary.nodes.total / 16);
    }
  }
}

/// Smaller meshes give a ball more threads.
class OptimizeOfSize : public test::CudaTest, public testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Cuda, OptimizeOfSize, testing::Values(21, 33, 68));

TEST_P(OptimizeOfSize, EqualsTheCpuBackendAndItself) {
  Comparison comparison("optimize, " + std::to_string(GetParam()) + " nodes a side");
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  const Mesh start = test::noisy(test::lattice(ElementType::tetrahedron, GetParam()), 0.15, 3);
  for (const Mesh& mesh : {start, test::as_float32(start)}) {
    SmoothOptions how = test::sweeps(3, Optimize{}, Form::gauss_seidel);
    comparison.run("free of limits", mesh, how);
    const Job expected = smooth_on(*smoother, mesh, how);
    for (int run = 1; run < 4; ++run) {
      EXPECT_TRUE(same_bits(smooth_on(*smoother, mesh, how).mesh, expected.mesh)) << "run " << run;
    }
    how.movement_limit = MovementLimit{.value = 1e-3, .relative = true};
    comparison.run("on a displacement_limit", mesh, how);
  }
}

class OnSurface : public test::CudaTest {};

TEST_F(OnSurface, OptimizeEqualsTheCpuBackend) {
  Comparison comparison("optimize, on curved surfaces");
  for (const auto& [name, mesh] : test::surfaces()) {
    for (const BoundaryPolicy boundary :
         {BoundaryPolicy::fixed, BoundaryPolicy::slide, BoundaryPolicy::free}) {
      SmoothOptions how = test::sweeps(4, Optimize{}, Form::gauss_seidel);
      how.guard = true;
      how.boundary = boundary;
      comparison.run(name, mesh, how);
      comparison.run(name, test::as_float32(mesh), how);
    }
  }
}

TEST_F(OnSurface, OptimizeStaysOnTheInputUntilItConverges) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const auto& [name, start] : test::surfaces()) {
    for (const Mesh& mesh : {start, test::as_float32(start)}) {
      for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
        SCOPED_TRACE(name);
        const Job job = smooth_on(*smoother, mesh, {.method = Optimize{.goal = goal}});

        EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
        EXPECT_GT(job.summary.deviation.tolerance, 0);
        EXPECT_LE(job.summary.deviation.result_to_input, job.summary.deviation.tolerance);
        EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
        EXPECT_GT(job.summary.nodes.sliding_on_surface, 0);
        EXPECT_TRUE(same_bits(smooth_on(*smoother, mesh, {.method = Optimize{.goal = goal}}).mesh,
                              job.mesh));
      }
    }
  }
}

// --- with the asynchronous form -------------------------------------------------------

class EveryWayAndAsynchronous : public EveryWay {};
INSTANTIATE_TEST_SUITE_P(Cuda, EveryWayAndAsynchronous, testing::ValuesIn(test::ways(true)),
                         test::way_name);

TEST_P(EveryWayAndAsynchronous, KeepsAValidMeshValidUnderTheGuard) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::horseshoe(type, element_shape(type).dimension == 2 ? 41 : 11);
    for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
      const Job job = smooth_on(*smoother, start, options(15, true));
      const QualityStats after = measure_quality(job.mesh);

      EXPECT_EQ(job.summary.quality_before.inverted_count, 0) << "the test's own mesh";
      EXPECT_EQ(after.inverted_count, 0) << element_name(type);
      EXPECT_EQ(after.degenerate_count, 0) << element_name(type);
      EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
      EXPECT_GT(job.summary.nodes.moved, 0);
    }
  }
}

TEST_P(EveryWayAndAsynchronous, LeavesFixedAndIsolatedNodesBitForBit) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const ElementType type : kLinearTypes) {
    Mesh mesh =
        test::with_mask(test::with_isolated_node(test::noisy(test::lattice(type, 7), 0.12, 5)));
    test::points(mesh)[0].z = -0.0;  // a bit that arithmetic would lose
    for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
      const Job job = smooth_on(*smoother, start, options(4, false));

      const std::vector<bool> held = test::oracle::held_nodes(start);
      std::visit(
          [&]<class Points>(const Points& after) {
            const auto& before = std::get<Points>(start.positions);
            for (std::size_t n = 0; n < held.size(); ++n) {
              if (!held[n]) continue;
              EXPECT_EQ(std::memcmp(&before[n], &after[n], sizeof before[n]), 0) << "node " << n;
            }
          },
          job.mesh.positions);
      EXPECT_GT(job.summary.nodes.moved, 0);
      EXPECT_EQ(job.summary.nodes.isolated, 1);
    }
  }
}

// --- for compute-sanitizer ------------------------------------------------------

/// Every kernel at least once, on as little as will do: compute-sanitizer slows a
/// program down by up to a thousand. `gpu-test sanitizers` runs these.
class Sanitized : public EveryWay {};
INSTANTIATE_TEST_SUITE_P(Cuda, Sanitized, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(Sanitized, RunsOnMeshesOfEveryElementType) {
  const std::unique_ptr<Smoother> cuda = make_smoother("cuda");
  for (const Mesh& mesh : {test::with_isolated_node(test::noisy(test::mixed_stack(3), 0.1, 1)),
                           test::noisy(test::lattice(ElementType::tetrahedron, 3), 0.1, 2),
                           test::noisy(test::spokes(2), 0.02, 4),
                           test::as_float32(test::noisy(test::sphere(1), 0.02, 4)),
                           // Several patches that exchange their halos, and one that does not fit.
                           test::as_float32(test::noisy(test::sphere(3), 0.02, 4)),
                           test::as_float32(test::noisy(test::spokes(3), 0.02, 4))}) {
    for (const bool guard : {false, true}) {
      SmoothOptions how = options(guard ? 2 : 5, guard);
      how.quality_detail = guard ? QualityDetail::full : QualityDetail::brief;
      how.element_quality_metrics.assign(kQualityMetrics.begin(), kQualityMetrics.end());
      how.feature_angle = 90;  // else all edges of the coarse sphere are features
      const Job job = smooth_on(*cuda, mesh, how);

      EXPECT_GT(job.summary.convergence.iteration_count, 0);
      if (GetParam().form == Form::asynchronous) continue;
      const Job expected = test::smooth(mesh, how);
      EXPECT_EQ(job.summary.convergence.iteration_count,
                expected.summary.convergence.iteration_count);
      EXPECT_LE(test::difference(job.mesh, to_points(expected.mesh)), 1e-6);
    }
    if (std::holds_alternative<Optimize>(GetParam().method)) {
      SmoothOptions how = options(2, true);
      how.feature_angle = 90;
      how.movement_limit = MovementLimit{.value = 0.01, .relative = true};
      EXPECT_GT(smooth_on(*cuda, mesh, how).summary.nodes.moved, 0);
    }
  }
}

}  // namespace
}  // namespace meshsmooth
