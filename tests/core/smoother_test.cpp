// The promises of the smoother, for every method in every form.

#include "meshsmooth/smoother.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/descent.hpp"
#include "support/growing_time.hpp"

namespace meshsmooth {
namespace {

using test::difference;
using test::Job;
using test::same_bits;
using test::sweeps;
using test::oracle::Points;
using test::oracle::to_points;
using testing::AllOf;
using testing::ElementsAre;
using testing::Ge;
using testing::HasSubstr;
using testing::Le;

/// What smoothing throws, and whether the mesh was left as it was.
template <class Thrown>
Thrown error_of(Mesh mesh, const SmoothOptions& options, const JobControl& control = {}) {
  const Mesh before = mesh;
  try {
    make_smoother("cpu", 2)->smooth(mesh, options, control);
  } catch (const Thrown& error) {
    EXPECT_TRUE(same_bits(mesh, before)) << "positions were touched";
    return error;
  }
  throw std::runtime_error("nothing thrown");
}

Mesh noisy_lattice(ElementType type, unsigned seed = 5) {
  return test::noisy(test::lattice(type, 5), 0.12, seed);
}

/// A lattice curved into most of a narrow ring: plain averaging pulls its nodes
/// over the inner wall.
Mesh horseshoe(ElementType type, unsigned seed) {
  const bool surface = test::oracle::is_surface(type);
  return test::mapped(test::noisy(test::lattice(type, 6), 0.05, seed), [=](Vec3d p) {
    const double angle = p.x / 6 * 4, radius = 0.3 + p.y / 6;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), surface ? 0.0 : p.z / 6};
  });
}

/// Of the elements, whether each is valid.
bool is_valid(const Mesh& mesh) {
  const QualityStats stats = measure_quality(mesh);
  return stats.inverted_count == 0 && stats.degenerate_count == 0;
}

// --- every method in every form -------------------------------------------------

class EveryWay : public testing::TestWithParam<test::Way> {
 protected:
  [[nodiscard]] SmoothOptions options(int count) const {
    return sweeps(count, GetParam().method, GetParam().form);
  }
  /// A filter of a number of terms, not a number of like sweeps: see smoother_oracle_test.
  [[nodiscard]] bool is_filter() const {
    return std::holds_alternative<WindowedSinc>(GetParam().method);
  }
};
INSTANTIATE_TEST_SUITE_P(Smoother, EveryWay, testing::ValuesIn(test::ways(true)), test::way_name);

/// All but the asynchronous form, which is the one exception.
class EveryRepeatableWay : public EveryWay {};
INSTANTIATE_TEST_SUITE_P(Smoother, EveryRepeatableWay, testing::ValuesIn(test::ways(false)),
                         test::way_name);

TEST_P(EveryWay, LeavesFixedAndIsolatedNodesAndConnectivityBitForBit) {
  for (const bool guard : {false, true}) {
    for (const ElementType type : kLinearTypes) {
      Mesh mesh = test::with_isolated_node(noisy_lattice(type));
      mesh.fixed.assign(mesh.node_count(), 0);
      for (std::size_t n = 0; n < mesh.node_count(); n += 4) mesh.fixed[n] = 255;
      test::points(mesh)[0].z = -0.0;  // a bit that arithmetic would lose
      for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
        SmoothOptions how = options(4);
        how.guard = guard;

        const Job job = test::smooth(start, how);

        ASSERT_EQ(job.mesh.blocks.size(), 1U);
        EXPECT_EQ(job.mesh.blocks[0].nodes, start.blocks[0].nodes);
        EXPECT_EQ(job.mesh.fixed, start.fixed);
        const std::vector<bool> held = test::oracle::held_nodes(start);
        std::int64_t moved = 0;
        std::visit(
            [&]<class P>(const P& after) {
              const P& before = std::get<P>(start.positions);
              for (std::size_t n = 0; n < held.size(); ++n) {
                const bool same = std::memcmp(&before[n], &after[n], sizeof before[n]) == 0;
                EXPECT_TRUE(same || !held[n]) << "node " << n;
                moved += same ? 0 : 1;
              }
            },
            job.mesh.positions);
        EXPECT_GT(moved, 0);
        EXPECT_EQ(job.summary.nodes.moved, moved);
        EXPECT_EQ(job.summary.nodes.isolated, 1);
      }
    }
  }
}

TEST_P(EveryWay, HoldsARegularLatticeStill) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::lattice(type, 5);
    for (const bool guard : {false, true}) {
      SmoothOptions how = options(10);
      how.guard = guard;

      const Job job = test::smooth(mesh, how);

      // VTK's filter changes the size.
      const double near = is_filter() ? 1e-5 : 1e-14;
      EXPECT_LT(difference(job.mesh, to_points(mesh)), near) << element_name(type);
    }
  }
}

TEST_P(EveryRepeatableWay, GivesTheSameBitsForEveryNumberOfThreadsAndOnEveryRun) {
  for (const bool guard : {false, true}) {
    SmoothOptions how = options(6);
    how.guard = guard;
    for (const Mesh& mesh :
         {test::noisy(test::lattice(ElementType::tetrahedron, 14), 0.2, 3),
          test::noisy(test::mixed_stack(14), 0.2, 4), test::noisy(test::sphere(4), 0.02, 4)}) {
      const Job expected = test::smooth(mesh, how, 1);
      for (const int threads : {1, 2, 5, 5}) {
        const Job job = test::smooth(mesh, how, threads);

        EXPECT_TRUE(same_bits(job.mesh, expected.mesh)) << threads << " threads";
        EXPECT_EQ(job.summary.convergence.last_max_displacement,
                  expected.summary.convergence.last_max_displacement);
        EXPECT_EQ(job.summary.convergence.last_rms_displacement,
                  expected.summary.convergence.last_rms_displacement);
        EXPECT_EQ(job.summary.convergence.held_node_count,
                  expected.summary.convergence.held_node_count);
        EXPECT_EQ(job.summary.quality_after.metrics[0].mean,
                  expected.summary.quality_after.metrics[0].mean);
      }
    }
  }
}

TEST_P(EveryRepeatableWay, GivesTheSameBitsWhenASmootherIsUsedAgain) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cpu", 2);
  Mesh first = noisy_lattice(ElementType::tetrahedron);
  Mesh between = noisy_lattice(ElementType::quad);
  Mesh second = first;

  smoother->smooth(first, options(5));
  smoother->smooth(between, options(5));
  smoother->smooth(second, options(5));

  EXPECT_TRUE(same_bits(first, second));
}

TEST_P(EveryRepeatableWay, CommutesWithMovingAndTurningTheMesh) {
  const auto turn = [](Vec3d p) {
    return Vec3d{0.6 * p.x - 0.8 * p.y + 7, 0.28 * (0.8 * p.x + 0.6 * p.y) - 0.96 * p.z,
                 0.96 * (0.8 * p.x + 0.6 * p.y) + 0.28 * p.z - 3};
  };
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = noisy_lattice(type);
    const Mesh smoothed = test::smooth(mesh, options(3)).mesh;

    const Mesh turned = test::smooth(test::mapped(mesh, turn), options(3)).mesh;

    EXPECT_LT(difference(turned, to_points(test::mapped(smoothed, turn))), 1e-12)
        << element_name(type);
  }
}

TEST_P(EveryRepeatableWay, CommutesBitForBitWithScalingByAPowerOfTwo) {
  const auto scale = [](Vec3d p) { return 1024.0 * p; };
  for (const bool guard : {false, true}) {
    SmoothOptions how = options(3);
    how.guard = guard;
    for (const ElementType type : kLinearTypes) {
      const Mesh mesh = noisy_lattice(type);
      const Mesh smoothed = test::smooth(mesh, how).mesh;

      EXPECT_TRUE(same_bits(test::smooth(test::mapped(mesh, scale), how).mesh,
                            test::mapped(smoothed, scale)))
          << element_name(type);
    }
  }
}

TEST_P(EveryWay, KeepsAValidMeshValidUnderTheGuard) {
  SmoothOptions how = options(15);
  how.guard = true;
  for (const ElementType type : kLinearTypes) {
    for (unsigned seed = 0; seed < 6; ++seed) {
      const Mesh mesh =
          seed % 2 == 0 ? horseshoe(type, seed) : test::noisy(test::lattice(type, 6), 0.12, seed);
      ASSERT_GT(test::oracle::worst_mean_ratio(mesh), 0) << "the test's own mesh is not valid";
      for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
        ASSERT_TRUE(is_valid(start));

        const Job job = test::smooth(start, how);

        EXPECT_GT(test::oracle::worst_mean_ratio(job.mesh), 0)
            << element_name(type) << ", seed " << seed;
        EXPECT_TRUE(is_valid(job.mesh)) << element_name(type) << ", seed " << seed;
        EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
        EXPECT_EQ(job.summary.quality_after.degenerate_count, 0);
      }
    }
  }
}

TEST_P(EveryWay, InvertsNoElementOfATangledMeshThatWasValid) {
  SmoothOptions how = options(10);
  how.guard = true;
  Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 6), 0.45, 7);
  const auto inverted_ids = [](const Mesh& m) {
    std::set<std::size_t> ids;
    const std::vector<test::oracle::Element> all = test::oracle::elements(m);
    const Points x = to_points(m);
    for (std::size_t e = 0; e < all.size(); ++e) {
      const Points p = test::oracle::corners(all[e], x);
      if (test::oracle::quality(all[e].type, p).mean_ratio < 0) ids.insert(e);
    }
    return ids;
  };
  const std::set<std::size_t> before = inverted_ids(mesh);
  ASSERT_GT(before.size(), 10U);

  const Job job = test::smooth(mesh, how);

  const std::set<std::size_t> after = inverted_ids(job.mesh);
  EXPECT_TRUE(std::includes(before.begin(), before.end(), after.begin(), after.end()));
  EXPECT_EQ(job.summary.quality_before.inverted_count, static_cast<std::int64_t>(before.size()));
  EXPECT_EQ(job.summary.quality_after.inverted_count, static_cast<std::int64_t>(after.size()));
}

TEST_P(EveryWay, TellsWhatItDid) {
  SmoothOptions how = options(5);
  how.history = true;
  const Mesh mesh = test::with_isolated_node(test::noisy(test::mixed_stack(5), 0.2, 4));

  const Job job = test::smooth(mesh, how);
  const SmoothSummary& summary = job.summary;
  const Convergence& convergence = summary.convergence;

  EXPECT_EQ(summary.stop_reason, StopReason::iteration_limit);
  EXPECT_EQ(convergence.iteration_count, 5);
  ASSERT_EQ(convergence.max_displacements.size(), 5U);
  ASSERT_EQ(convergence.rms_displacements.size(), 5U);
  ASSERT_EQ(convergence.moved_node_counts.size(), 5U);
  ASSERT_EQ(convergence.energies.size(), 5U);
  ASSERT_EQ(convergence.worst_mean_ratios.size(), 5U);
  EXPECT_EQ(convergence.max_displacements.back(), convergence.last_max_displacement);
  EXPECT_EQ(convergence.rms_displacements.back(), convergence.last_rms_displacement);
  EXPECT_LE(convergence.last_rms_displacement, convergence.last_max_displacement);
  EXPECT_NEAR(convergence.bounding_box_diagonal, test::diagonal(mesh), 1e-14);
  EXPECT_EQ(convergence.tolerance, 0);

  const auto boundary = static_cast<std::int64_t>(test::oracle::boundary_nodes(mesh).size());
  EXPECT_EQ(summary.nodes.total, static_cast<std::int64_t>(mesh.node_count()));
  EXPECT_EQ(summary.nodes.boundary, boundary);
  EXPECT_EQ(summary.nodes.fixed, boundary);
  EXPECT_EQ(summary.nodes.isolated, 1);
  EXPECT_LE(summary.nodes.moved, summary.nodes.total - boundary - 1);
  EXPECT_GT(summary.nodes.moved, (summary.nodes.total - boundary - 1) / 2);

  EXPECT_EQ(summary.backend, "cpu");
  EXPECT_EQ(summary.thread_count, 2);
  EXPECT_FALSE(summary.device_name.empty());
  EXPECT_EQ(summary.colour_count > 0, GetParam().form == Form::gauss_seidel);
  EXPECT_GT(summary.host_peak_bytes, 0);
  EXPECT_GT(summary.times.iterate_seconds, 0);
}

TEST_P(EveryWay, EvaluatesBeforeAndAfterAsTheMeshesAre) {
  const Mesh mesh = test::noisy(test::mixed_stack(4), 0.2, 4);

  const Job job = test::smooth(mesh, options(3));

  const auto compare = [](const QualityStats& told, const QualityStats& truth) {
    EXPECT_EQ(told.element_count, truth.element_count);
    EXPECT_EQ(told.inverted_count, truth.inverted_count);
    EXPECT_NEAR(told.sum_absolute_volume, truth.sum_absolute_volume, 1e-11);
    EXPECT_NEAR(told.enclosed_volume, truth.enclosed_volume, 1e-11);
    ASSERT_EQ(told.metrics.size(), truth.metrics.size());
    for (std::size_t m = 0; m < told.metrics.size(); ++m) {
      EXPECT_EQ(told.metrics[m].min, truth.metrics[m].min);
      EXPECT_EQ(told.metrics[m].histogram, truth.metrics[m].histogram);
      EXPECT_NEAR(told.metrics[m].mean, truth.metrics[m].mean, 1e-11);
    }
    ASSERT_EQ(told.worst.size(), truth.worst.size());
    for (std::size_t w = 0; w < told.worst.size(); ++w) {
      EXPECT_EQ(told.worst[w].element, truth.worst[w].element);
      EXPECT_EQ(told.worst[w].mean_ratio, truth.worst[w].mean_ratio);
    }
  };
  compare(job.summary.quality_before, measure_quality(mesh));
  compare(job.summary.quality_after, measure_quality(job.mesh));
}

TEST_P(EveryWay, StopsAtOnceWhenNothingIsFree) {
  const Job job = test::smooth(test::two_tets(), options(5));

  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
  EXPECT_EQ(job.summary.convergence.iteration_count, 0);
  EXPECT_EQ(job.summary.nodes.moved, 0);
  EXPECT_EQ(job.summary.locked.element_count, 2);
  EXPECT_TRUE(same_bits(job.mesh, test::two_tets()));
}

TEST_P(EveryWay, OnlyEvaluatesWithoutIterations) {
  const Mesh mesh = noisy_lattice(ElementType::wedge);

  const Job job = test::smooth(mesh, options(0));

  EXPECT_TRUE(same_bits(job.mesh, mesh));
  EXPECT_EQ(job.summary.convergence.iteration_count, 0);
  EXPECT_EQ(job.summary.stop_reason, StopReason::iteration_limit);
  EXPECT_EQ(job.summary.quality_after.metrics[0].mean, job.summary.quality_before.metrics[0].mean);
}

TEST_P(EveryWay, LeavesThePositionsWhenCancelled) {
  for (const int at : {0, 3}) {
    std::stop_source source;
    JobControl control;
    control.stop = source.get_token();
    control.on_progress = [&](const Progress& progress) {
      if (progress.stage == Stage::iterate && progress.iteration == at) source.request_stop();
    };

    const auto error =
        error_of<Cancelled>(noisy_lattice(ElementType::tetrahedron), options(10), control);

    EXPECT_EQ(error.reason(), "CANCELLED");
  }
}

TEST_P(EveryWay, LeavesThePositionsWhenTheDeadlinePasses) {
  using Clock = std::chrono::steady_clock;
  JobControl past, running;
  past.deadline = Clock::now();
  running.deadline = Clock::now() + std::chrono::milliseconds(200);
  running.on_progress = [&](const Progress& progress) {
    if (progress.stage != Stage::iterate || progress.iteration == 0) return;
    while (Clock::now() < *running.deadline) {
    }
  };

  for (const JobControl& control : {past, running}) {
    EXPECT_EQ(
        error_of<DeadlineExceeded>(noisy_lattice(ElementType::tetrahedron), options(10), control)
            .reason(),
        "DEADLINE_RUNNING");
  }
}

TEST_P(EveryRepeatableWay, FinishesEarlyWithThePositionsReached) {
  if (is_filter()) return;
  std::atomic<bool> finish = false;
  JobControl control;
  control.finish_early = &finish;
  control.on_progress = [&](const Progress& progress) {
    if (progress.stage == Stage::iterate && progress.iteration == 3) finish = true;
  };
  const Mesh mesh = noisy_lattice(ElementType::hexahedron);

  const Job job = test::smooth(mesh, options(50), 2, control);

  EXPECT_EQ(job.summary.stop_reason, StopReason::cancelled_with_result);
  EXPECT_EQ(job.summary.convergence.iteration_count, 3);
  EXPECT_TRUE(same_bits(job.mesh, test::smooth(mesh, options(3)).mesh));
}

TEST_P(EveryWay, KeepsWhatItReachedWithinTheComputeBudget) {
  test::with_growing_time([this](auto budget) {
    SmoothOptions how = options(50);
    how.compute_budget = budget;
    JobControl control;
    control.on_progress = [budget](const Progress& progress) {
      if (progress.stage != Stage::iterate || progress.iteration != 2) return;
      const auto end = std::chrono::steady_clock::now() + budget;
      while (std::chrono::steady_clock::now() < end) {
      }
    };

    const Job job = test::smooth(noisy_lattice(ElementType::hexahedron), how, 2, control);

    EXPECT_EQ(job.summary.stop_reason, StopReason::compute_budget);
    EXPECT_THAT(job.summary.convergence.iteration_count, Le(2));
    EXPECT_EQ(job.summary.nodes.moved > 0, job.summary.convergence.iteration_count > 0);
    return job.summary.convergence.iteration_count > 0;
  });
}

TEST_P(EveryWay, MayHaveAllTheTimeThatThereIs) {
  SmoothOptions how = options(2);
  how.compute_budget = std::chrono::nanoseconds::max();

  const Job job = test::smooth(noisy_lattice(ElementType::hexahedron), how);

  EXPECT_NE(job.summary.stop_reason, StopReason::compute_budget);
}

TEST_P(EveryWay, ConvergesWhenTheLargestMoveIsBelowTheTolerance) {
  if (is_filter()) return;
  const Mesh mesh = noisy_lattice(ElementType::tetrahedron);
  SmoothOptions how = options(2000);
  how.tolerance = {1e-2};
  // A relative tolerance of Optimize is one of its energy.
  const auto* const optimize = std::get_if<Optimize>(&how.method);
  if (optimize != nullptr) how.tolerance = {1e-2 * test::diagonal(mesh), false};
  how.history = true;

  const Job job = test::smooth(mesh, how);
  const Convergence& convergence = job.summary.convergence;

  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
  EXPECT_NEAR(convergence.tolerance, 1e-2 * convergence.bounding_box_diagonal, 1e-15);
  EXPECT_LT(convergence.last_max_displacement, convergence.tolerance);
  if (optimize != nullptr && optimize->goal == Goal::worst) return;  // converges in each phase
  for (std::size_t n = 0; n + 1 < convergence.max_displacements.size(); ++n) {
    EXPECT_GE(convergence.max_displacements[n], convergence.tolerance);
  }
}

TEST_P(EveryWay, TellsEnergyAndWorstElementOfEverySweep) {
  const auto* const optimize = std::get_if<Optimize>(&GetParam().method);
  const double p = optimize == nullptr ? 2 : optimize->goal == Goal::average ? 1 : 2;
  if (optimize != nullptr && optimize->goal == Goal::worst) return;  // see optimize_test.cpp
  for (const Mesh& mesh :
       {test::noisy(test::mixed_stack(4), 0.12, 7), noisy_lattice(ElementType::triangle)}) {
    for (int count = 1; count <= 3; ++count) {
      SmoothOptions how = options(count);
      how.guard = true;
      how.history = true;

      const Job job = test::smooth(mesh, how);
      const Convergence& told = job.summary.convergence;

      ASSERT_EQ(told.energies.size(), static_cast<std::size_t>(count));
      ASSERT_EQ(told.worst_mean_ratios.size(), static_cast<std::size_t>(count));
      EXPECT_NEAR(told.energies.back(), test::oracle::mean_energy(job.mesh, p), 1e-12);
      EXPECT_NEAR(told.worst_mean_ratios.back(), test::oracle::worst_mean_ratio(job.mesh), 1e-12);
      how.history = false;
      const Job unwatched = test::smooth(mesh, how);
      EXPECT_TRUE(unwatched.summary.convergence.energies.empty());
      if (GetParam().form != Form::asynchronous) {
        EXPECT_TRUE(test::same_bits(job.mesh, unwatched.mesh));
      }
    }
  }
}

TEST_P(EveryWay, ReportsProgressStageByStageAndSweepBySweep) {
  std::vector<Stage> stages;
  std::vector<int> iterations;
  const std::thread::id own = std::this_thread::get_id();
  JobControl control;
  control.on_progress = [&](const Progress& progress) {
    EXPECT_EQ(std::this_thread::get_id(), own);
    if (stages.empty() || stages.back() != progress.stage) stages.push_back(progress.stage);
    if (progress.stage == Stage::iterate) iterations.push_back(progress.iteration);
  };

  test::smooth(noisy_lattice(ElementType::tetrahedron), options(4), 2, control);

  EXPECT_THAT(stages, ElementsAre(Stage::find_neighbours, Stage::find_boundary, Stage::evaluate,
                                  Stage::iterate, Stage::evaluate));
  EXPECT_THAT(iterations, ElementsAre(0, 1, 2, 3, 4));
}

// --- single promises ------------------------------------------------------------

TEST(Guard, IsNeededOnTheHorseshoe) {
  for (const ElementType type : kLinearTypes) {
    const Job job = test::smooth(horseshoe(type, 0), sweeps(15, Laplacian{}));

    EXPECT_GT(job.summary.quality_after.inverted_count, 0)
        << "the guard's test proves nothing for " << element_name(type);
  }
}

TEST(Guard, IsOnByDefault) {
  const Job job = test::smooth(horseshoe(ElementType::tetrahedron, 0),
                               {.method = Laplacian{}, .never_worse = false});

  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
  EXPECT_GT(job.summary.nodes.moved, 0);
}

TEST(Guard, CountsTheNodesThatItHeld) {
  SmoothOptions options = sweeps(15, Laplacian{});
  const Mesh mesh = horseshoe(ElementType::hexahedron, 0);
  const Job free = test::smooth(mesh, options);
  options.guard = true;
  const Job guarded = test::smooth(mesh, options);

  EXPECT_EQ(free.summary.convergence.held_node_count, 0);
  EXPECT_GT(guarded.summary.convergence.held_node_count, 0);
}

TEST(SmartLaplacian, NeverMakesTheWorstElementWorse) {
  for (const Form form : {Form::automatic, Form::jacobi, Form::gauss_seidel, Form::asynchronous}) {
    for (const ElementType type : kLinearTypes) {
      Mesh mesh = horseshoe(type, 3);
      double worst = test::oracle::worst_mean_ratio(mesh);
      for (int sweep = 0; sweep < 8; ++sweep) {
        mesh = test::smooth(mesh, sweeps(1, SmartLaplacian{}, form)).mesh;
        const double now = test::oracle::worst_mean_ratio(mesh);

        EXPECT_GE(now, worst - 1e-12) << element_name(type);
        worst = now;
      }
    }
  }
}

TEST(SmartLaplacian, ImprovesANoisyMesh) {
  for (const ElementType type : kLinearTypes) {
    const Job job =
        test::smooth(test::noisy(test::lattice(type, 6), 0.2, 8), {.method = SmartLaplacian{}});

    EXPECT_GT(job.summary.quality_after.metrics[0].mean,
              job.summary.quality_before.metrics[0].mean + 0.01)
        << element_name(type);
    EXPECT_GE(job.summary.quality_after.metrics[0].min, job.summary.quality_before.metrics[0].min);
  }
}

TEST(SmartLaplacian, StagnatesWhenNoMoveIsTaken) {
  // The mean of the ring lies among the many nodes on the right, where the
  // element on the left would be worse.
  Mesh mesh = test::make_mesh({{0, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{ElementType::triangle, {}}});
  const int count = 9;
  for (int n = 0; n < count; ++n) {
    const double angle = (n - (count - 1) / 2.0) * 0.3;
    test::points(mesh).push_back({2 * std::cos(angle), 2 * std::sin(angle), 0});
  }
  const std::vector<NodeId> loop = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  for (std::size_t n = 0; n < loop.size(); ++n) {
    for (const NodeId node : {0, loop[n], loop[(n + 1) % loop.size()]}) {
      mesh.blocks[0].nodes.push_back(node);
    }
  }
  const Job settled = test::smooth(mesh, {.method = SmartLaplacian{}, .tolerance = {0}});

  const Job again = test::smooth(settled.mesh, {.method = SmartLaplacian{}, .tolerance = {0}});

  EXPECT_EQ(again.summary.stop_reason, StopReason::stagnated);
  EXPECT_EQ(again.summary.convergence.held_node_count, 1);
  EXPECT_TRUE(same_bits(again.mesh, settled.mesh));
}

TEST(Convergence, HoldsAnAbsoluteToleranceInTheMeshsUnit) {
  const Job job = test::smooth(noisy_lattice(ElementType::tetrahedron),
                               {.method = Laplacian{}, .tolerance = {0.003, false}});

  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
  EXPECT_EQ(job.summary.convergence.tolerance, 0.003);
  EXPECT_LT(job.summary.convergence.last_max_displacement, 0.003);
}

TEST(Locked, NamesTheWorstElementThatCannotBeRepaired) {
  // All nodes of the lattice are fixed but those of one corner's inside.
  Mesh mesh = noisy_lattice(ElementType::tetrahedron);
  const std::vector<bool> held = test::oracle::held_nodes(mesh);
  double worst = HUGE_VAL;
  std::int64_t count = 0, worst_id = -1, id = 0;

  const Job job = test::smooth(mesh, {.method = SmartLaplacian{}});

  const Points x = to_points(job.mesh);
  for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
    if (std::all_of(e.nodes.begin(), e.nodes.end(), [&](NodeId n) { return held[n]; })) {
      ++count;
      const double ratio = test::oracle::quality(e.type, test::oracle::corners(e, x)).mean_ratio;
      if (ratio < worst - 1e-12) {
        worst = ratio;
        worst_id = id;
      }
    }
    ++id;
  }
  EXPECT_GT(count, 0);
  EXPECT_EQ(job.summary.locked.element_count, count);
  ASSERT_TRUE(job.summary.locked.worst);
  EXPECT_NEAR(job.summary.locked.worst->mean_ratio, worst, 1e-12);
  EXPECT_EQ(job.summary.locked.worst->element, worst_id);
}

TEST(Summary, NamesTheLowestOfEquallyBadElements) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 4);

  const Job job = test::smooth(mesh, {.method = SmartLaplacian{}});

  std::vector<std::int64_t> ids;
  for (const ElementQuality& worst : job.summary.quality_before.worst) ids.push_back(worst.element);
  EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

// --- bad input ------------------------------------------------------------------

TEST(BadInput, ATangledMeshIsRefusedWhenTheCallerSaysSo) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.5, 2);
  const QualityStats stats = measure_quality(mesh);
  ASSERT_GT(stats.inverted_count, 0);

  const auto error =
      error_of<InvalidMesh>(mesh, {.method = SmartLaplacian{}, .tangled = TangledPolicy::refuse});
  const Job repaired =
      test::smooth(mesh, {.method = SmartLaplacian{}, .tangled = TangledPolicy::repair});

  EXPECT_EQ(error.reason(), "MESH_TANGLED");
  EXPECT_THAT(error.what(), HasSubstr("element " + std::to_string(stats.worst[0].element)));
  EXPECT_LT(repaired.summary.quality_after.inverted_count, stats.inverted_count);
}

TEST(BadInput, AFacetUsedThreeTimesIsNamed) {
  const auto error = error_of<InvalidMesh>(test::overused_facet(), {});

  EXPECT_EQ(error.reason(), "FACET_OVERUSED");
  EXPECT_THAT(error.what(), AllOf(HasSubstr("element 2"), HasSubstr("0, 1, 2")));
}

TEST(BadInput, AnInvalidMeshIsNamedBeforeAnyWork) {
  Mesh mesh = test::two_tets();
  mesh.blocks[0].nodes[2] = 77;
  bool worked = false;
  JobControl control;
  control.on_progress = [&](const Progress&) { worked = true; };

  EXPECT_EQ(error_of<InvalidMesh>(mesh, {}, control).reason(), "INDEX_OUT_OF_RANGE");
  EXPECT_EQ(error_of<InvalidMesh>(Mesh{}, {}, control).reason(), "MESH_EMPTY");
  EXPECT_FALSE(worked);
}

TEST(BadInput, AnOptionOutOfRangeIsNamed) {
  EXPECT_EQ(
      error_of<InvalidOption>(test::two_tets(), {.method = Laplacian{.relaxation = 2}}).reason(),
      "OPTION_OUT_OF_RANGE");
}

TEST(BadInput, ADegenerateElementIsNoReasonToFail) {
  Mesh mesh = test::tet_ball();
  test::points(mesh)[6] = test::points(mesh)[0];  // the free node on a fixed one

  const Job job = test::smooth(mesh, {.method = SmartLaplacian{}});

  EXPECT_GT(job.summary.quality_before.degenerate_count, 0);
  EXPECT_EQ(job.summary.quality_after.degenerate_count, 0);
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
}

TEST(BadInput, AMeshInOnePointStaysThere) {
  for (const test::Way& way : test::ways(true)) {
    const Mesh mesh = test::mapped(test::lattice(ElementType::tetrahedron, 3), [](Vec3d) {
      return Vec3d{1, 2, 3};
    });

    const Job job = test::smooth(mesh, sweeps(2, way.method, way.form));

    EXPECT_LT(test::oracle::max_distance(to_points(job.mesh), to_points(mesh)), 1e-14) << way.name;
    EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << way.name;
  }
}

// --- backends -------------------------------------------------------------------

TEST(MakeSmoother, KnowsItsBackends) {
  const std::vector<BackendInfo> backends = list_backends();
  ASSERT_FALSE(backends.empty());
  EXPECT_EQ(backends.back().name, "cpu");
  EXPECT_TRUE(backends.back().available);
  EXPECT_EQ(make_smoother("cpu", 3)->backend(), "cpu");
  // "auto" takes the first that can be used here.
  const auto first = std::find_if(backends.begin(), backends.end(),
                                  [](const BackendInfo& info) { return info.available; });
  EXPECT_EQ(make_smoother()->backend(), first->name);
}

TEST(MakeSmoother, NamesABackendThatIsNotHere) {
  try {
    static_cast<void>(make_smoother("abacus"));
    FAIL() << "nothing thrown";
  } catch (const NotSupported& error) {
    EXPECT_EQ(error.reason(), "BACKEND_NOT_AVAILABLE");
    EXPECT_THAT(error.what(), HasSubstr("abacus"));
  }
}

}  // namespace
}  // namespace meshsmooth
