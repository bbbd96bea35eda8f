// The promises of the method Optimize.

#include <gmock/gmock.h>

#include "core/promises.hpp"
#include "meshsmooth/error.hpp"
#include "support/descent.hpp"
#include "support/input_surface.hpp"
#include "support/throw_about.hpp"

namespace meshsmooth {
namespace {

using test::Job;
using test::mean_ratio;
using test::points;
using test::same_bits;
using testing::Each;
using testing::Ge;

constexpr Goal kGoals[] = {Goal::average, Goal::balanced, Goal::worst};

SmoothOptions optimize(Goal goal = Goal::balanced) { return {.method = Optimize{.goal = goal}}; }

SmoothOptions exactly(int sweeps, Goal goal) {
  SmoothOptions options = optimize(goal);
  options.max_iterations = sweeps;
  options.tolerance = {0};
  options.history = true;
  return options;
}

bool is_valid(const QualityStats& quality) {
  return quality.inverted_count == 0 && quality.degenerate_count == 0;
}

/// Noisy but valid meshes of every type, and a mixed one.
std::vector<std::pair<std::string, Mesh>> valid_meshes() {
  std::vector<std::pair<std::string, Mesh>> meshes;
  for (const ElementType type : kLinearTypes) {
    meshes.emplace_back(element_name(type), test::noisy(test::lattice(type, 4), 0.14, 6));
  }
  meshes.emplace_back("mixed", test::noisy(test::mixed_stack(4), 0.12, 7));
  return meshes;
}

TEST(Optimize, NeverLetsTheEnergyRise) {
  for (const auto& [name, mesh] : valid_meshes()) {
    for (const Goal goal : {Goal::average, Goal::balanced}) {
      SCOPED_TRACE(name);
      const double p = goal == Goal::average ? 1 : 2;
      double before = test::oracle::mean_energy(mesh, p);
      ASSERT_TRUE(std::isfinite(before));
      const Job whole = test::smooth(mesh, exactly(8, goal));
      for (int count = 1; count <= 8; ++count) {
        const Job job = test::smooth(mesh, exactly(count, goal));
        const double after = test::oracle::mean_energy(job.mesh, p);
        EXPECT_LE(after, before * (1 + 1e-13)) << count;
        before = after;
        if (static_cast<std::size_t>(count) > whole.summary.convergence.energies.size()) break;
        EXPECT_NEAR(whole.summary.convergence.energies[count - 1], after, 1e-12);
      }
    }
  }
}

TEST(Optimize, TellsTheWorstOfEverySweep) {
  for (const auto& [name, mesh] : valid_meshes()) {
    const Job job = test::smooth(mesh, exactly(3, Goal::balanced));
    const Convergence& told = job.summary.convergence;

    ASSERT_EQ(told.worst_mean_ratios.size(), 3U);
    EXPECT_NEAR(told.worst_mean_ratios.back(), test::oracle::worst_mean_ratio(job.mesh), 1e-12);
  }
}

TEST(Optimize, ReachesWhereTheTextbooksDescentGoes) {
  for (const auto& [name, mesh] : valid_meshes()) {
    for (const Goal goal : {Goal::average, Goal::balanced}) {
      const double p = goal == Goal::average ? 1 : 2;
      test::oracle::Descent slow(mesh, p);
      Mesh expected = mesh;
      test::oracle::Points x = test::oracle::to_points(mesh);
      for (int sweep = 0; sweep < 100; ++sweep) slow.sweep(x);
      for (std::size_t n = 0; n < x.size(); ++n) {
        points(expected)[n] = {x[n].x(), x[n].y(), x[n].z()};
      }
      SmoothOptions options = optimize(goal);
      options.tolerance = {1e-9};

      const Job job = test::smooth(mesh, options);

      const double least = test::oracle::mean_energy(expected, p);
      EXPECT_NEAR(test::oracle::mean_energy(job.mesh, p), least, 1e-5 * least) << name;
      EXPECT_GT(test::oracle::mean_energy(mesh, p), 1.01 * least) << name;
    }
  }
}

TEST(Optimize, ImprovesWhatTheGoalNames) {
  // Curved, so that the best place is not the lattice's.
  const Mesh mesh =
      test::mapped(test::noisy(test::lattice(ElementType::tetrahedron, 7), 0.2, 8), [](Vec3d p) {
        return Vec3d{p.x + std::sin(p.y), p.y + 0.7 * std::sin(0.9 * p.z), p.z + 0.1 * p.x * p.y};
      });
  double mean[3], worst[3];
  for (const Goal goal : kGoals) {
    const Job job = test::smooth(mesh, optimize(goal));
    EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
    EXPECT_TRUE(is_valid(job.summary.quality_after));
    mean[static_cast<int>(goal)] = mean_ratio(job.summary.quality_after).mean;
    worst[static_cast<int>(goal)] = mean_ratio(job.summary.quality_after).min;
  }
  EXPECT_GT(mean[0], mean[1]);
  EXPECT_GT(mean[1], mean[2]);
  EXPECT_LT(worst[0], worst[1]);
  EXPECT_LT(worst[1], worst[2]);
  EXPECT_GT(mean[1], mean_ratio(measure_quality(mesh)).mean);
}

TEST(Optimize, RepairsMeshesThrownAboutToTheSameOptimum) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron,
                                 ElementType::wedge, ElementType::triangle, ElementType::quad}) {
    const bool surface = test::oracle::is_surface(type);
    const Mesh good = test::noisy(test::lattice(type, surface ? 16 : 7), 0.1, 9);
    for (const Goal goal : {Goal::average, Goal::balanced}) {
      SmoothOptions options = optimize(goal);
      options.tolerance = {1e-7};
      const double best = mean_ratio(test::smooth(good, options).summary.quality_after).mean;
      for (const double share : {0.075, 0.3, 0.45}) {
        SCOPED_TRACE(std::string(element_name(type)) + " " + std::to_string(share));
        const Mesh tangled = test::thrown_about(good, share, 10);
        ASSERT_NEAR(test::inverted_share(tangled), share, 0.03);

        const Job job = test::smooth(tangled, options);

        EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
        EXPECT_EQ(job.summary.quality_after.degenerate_count, 0);
        EXPECT_NEAR(mean_ratio(job.summary.quality_after).mean, best, 0.002);
      }
    }
  }
}

TEST(Optimize, KeepsToTheSweepsItMayDoWhereverThePhasesEnd) {
  const Mesh tangled =
      test::thrown_about(test::noisy(test::lattice(ElementType::tetrahedron, 7), 0.1, 9), 0.3, 10);
  SmoothOptions options = optimize(Goal::worst);
  const int all = test::smooth(tangled, options).summary.convergence.iteration_count;
  ASSERT_GT(all, 10);
  for (int most = 1; most < all; ++most) {
    options.max_iterations = most;

    const SmoothSummary summary = test::smooth(tangled, options).summary;

    EXPECT_EQ(summary.convergence.iteration_count, most);
    EXPECT_EQ(summary.stop_reason, StopReason::iteration_limit);
  }
}

TEST(Optimize, RefusesATangledMeshWhenAskedTo) {
  const Mesh tangled = test::thrown_about(test::lattice(ElementType::tetrahedron, 4), 0.1, 11);
  SmoothOptions options = optimize();
  options.tangled = TangledPolicy::refuse;
  try {
    test::smooth(tangled, options);
    FAIL() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "MESH_TANGLED");
  }
}

TEST(Optimize, KeepsValidElementsValidWhereNotAllCanBeRepaired) {
  // The upper pole lies below the lower one: no place is right for both halves.
  Mesh mesh = test::tet_ball();
  points(mesh)[4] = {0, 0, -3};
  ASSERT_GT(measure_quality(mesh).inverted_count, 0);
  ASSERT_LT(measure_quality(mesh).inverted_count, 8);
  for (const Goal goal : kGoals) {
    const Job job = test::smooth(mesh, optimize(goal));

    EXPECT_TRUE(test::keeps_valid_elements(mesh, job.mesh));
    EXPECT_EQ(job.summary.stop_reason, StopReason::stagnated);
    EXPECT_LE(job.summary.quality_after.inverted_count, job.summary.quality_before.inverted_count);
  }
}

TEST(Optimize, SpendsNoSweepsOnElementsThatStayFlat) {
  // A triangle on an edge of the square: wherever its third node slides, it has no area.
  Mesh mesh = test::noisy(test::lattice(ElementType::triangle, 8), 0.1, 3);
  const SmoothOptions options{.method = Optimize{}, .boundary = BoundaryPolicy::slide};
  const Job without = test::smooth(mesh, options);
  const auto third = static_cast<NodeId>(mesh.node_count());
  std::vector<Vec3d>& at = points(mesh);
  at.push_back(0.5 * (at[0] + at[1]));
  std::vector<NodeId>& nodes = mesh.blocks.front().nodes;
  nodes.insert(nodes.end(), {0, third, 1});
  const Job with = test::smooth(mesh, options);

  EXPECT_EQ(with.summary.stop_reason, StopReason::stagnated);
  EXPECT_EQ(with.summary.quality_after.degenerate_count, 1);
  EXPECT_EQ(with.summary.quality_after.inverted_count, 0);
  // Ten that try to repair it and ten in which nothing improves, but not the hundred that soften.
  EXPECT_LE(with.summary.convergence.iteration_count,
            without.summary.convergence.iteration_count + 30);
}

TEST(Optimize, KeepsAGradedMeshGraded) {
  // Similar cells that grow by a fifth from each to the next.
  const double growth = 0.2;
  const auto graded = [=](Vec3d p) {
    const double size = std::exp(growth * p.z);
    return size * Vec3d{std::sin(growth * (p.x - 3)),
                        std::cos(growth * (p.x - 3)) * std::sin(growth * (p.y - 3)),
                        std::cos(growth * (p.x - 3)) * std::cos(growth * (p.y - 3))};
  };
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    const Mesh regular = test::lattice(type, 6);
    const Mesh truth = test::mapped(regular, graded);
    const Mesh start = test::mapped(test::noisy(regular, 0.15, 12), graded);
    SmoothOptions options = optimize();
    options.tolerance = {1e-7};

    const Job job = test::smooth(start, options);

    // Lengths of the edges between neighbouring inner layers, as they should be.
    const auto gap = [](const Mesh& mesh, int layer) {
      const auto at = [&](int k) { return points(mesh)[(k * 7 + 3) * 7 + 3]; };
      return norm(at(layer + 1) - at(layer));
    };
    for (int layer = 0; layer < 6; ++layer) {
      EXPECT_NEAR(gap(job.mesh, layer) / gap(truth, layer), 1, 0.05) << layer;
    }
    EXPECT_GT(gap(truth, 5) / gap(truth, 0), 2.5);
  }
}

TEST(Optimize, LeavesPlaneMeshesInTheirPlane) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const Mesh flat = test::mapped(test::noisy(test::lattice(type, 9), 0.2, 13), [](Vec3d p) {
      return Vec3d{p.x, p.y, 0.1};
    });
    const Job job = test::smooth(flat, optimize());
    EXPECT_GT(job.summary.nodes.moved, 0);
    for (const Vec3d& p : points(job.mesh)) EXPECT_EQ(p.z, 0.1);

    const Vec3d s{0.6, 0.48, 0.64}, t{-0.8, 0.36, 0.48}, normal = cross(s, t);
    const Mesh tilted = test::mapped(flat, [&](Vec3d p) { return p.x * s + p.y * t; });
    const Job turned = test::smooth(tilted, optimize());
    for (std::size_t n = 0; n < points(tilted).size(); ++n) {
      EXPECT_NEAR(dot(points(turned.mesh)[n], normal), 0, 1e-14 * test::diagonal(tilted));
      const Vec3d expected = points(job.mesh)[n].x * s + points(job.mesh)[n].y * t;
      EXPECT_LT(norm(points(turned.mesh)[n] - expected), 1e-6);
    }
  }
}

TEST(Optimize, MovesTheNodesOfACurvedSurfaceAlongIt) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> noise(-0.03, 0.03);
  const Mesh mesh = test::mapped(test::sphere(4), [&](Vec3d p) {
    const Vec3d q = p + Vec3d{noise(random), noise(random), noise(random)};
    return (1 / norm(q)) * q;
  });

  const Job job = test::smooth(mesh, optimize());

  EXPECT_TRUE(is_valid(job.summary.quality_after));
  EXPECT_GT(mean_ratio(job.summary.quality_after).mean,
            mean_ratio(job.summary.quality_before).mean);
  EXPECT_GT(mean_ratio(job.summary.quality_after).min, mean_ratio(job.summary.quality_before).min);
  const test::InputSurface input(mesh);
  for (const Vec3d& p : points(job.mesh)) {
    EXPECT_LE(input.distance(test::oracle::to_point(p)), job.summary.deviation.tolerance);
  }
}

TEST(Optimize, StopsAtTheTargetQuality) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 7), 0.2, 14);
  const double start = test::oracle::worst_mean_ratio(mesh);
  const Job whole = test::smooth(mesh, optimize(Goal::worst));
  const double best = mean_ratio(whole.summary.quality_after).min;
  ASSERT_LT(start + 0.05, best);
  for (const Goal goal : {Goal::balanced, Goal::worst}) {
    SmoothOptions options = optimize(goal);
    std::get<Optimize>(options.method).target_quality = 0.5 * (start + best);
    const Job job = test::smooth(mesh, options);
    EXPECT_EQ(job.summary.stop_reason, StopReason::target_reached);
    EXPECT_GE(mean_ratio(job.summary.quality_after).min, 0.5 * (start + best));
    EXPECT_LT(job.summary.convergence.iteration_count, whole.summary.convergence.iteration_count);

    const Job again = test::smooth(job.mesh, options);
    EXPECT_EQ(again.summary.stop_reason, StopReason::target_reached);
    EXPECT_EQ(again.summary.convergence.iteration_count, 0);
    EXPECT_EQ(again.summary.nodes.moved, 0);

    std::get<Optimize>(options.method).target_quality = 0.99;
    EXPECT_EQ(test::smooth(mesh, options).summary.stop_reason, StopReason::converged);
  }
}

TEST(Optimize, GivesTheBestSoFarWhenTheBudgetEnds) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 7), 0.2, 15);
  SmoothOptions options = exactly(1000, Goal::balanced);
  options.compute_budget = std::chrono::nanoseconds(1);
  const Job none = test::smooth(mesh, options);
  EXPECT_EQ(none.summary.stop_reason, StopReason::compute_budget);
  EXPECT_TRUE(same_bits(none.mesh, mesh));

  // Ended from outside after two sweeps: as good as two sweeps are.
  options.compute_budget.reset();
  std::atomic<bool> finish = false;
  JobControl control;
  control.finish_early = &finish;
  control.on_progress = [&](const Progress& progress) {
    if (progress.stage == Stage::iterate && progress.iteration == 2) finish = true;
  };
  const Job two = test::smooth(mesh, options, 2, control);
  EXPECT_EQ(two.summary.stop_reason, StopReason::cancelled_with_result);
  EXPECT_TRUE(same_bits(two.mesh, test::smooth(mesh, exactly(2, Goal::balanced)).mesh));
}

TEST(Optimize, GivesTheSameBitsForEveryNumberOfThreads) {
  const Mesh good = test::noisy(test::lattice(ElementType::tetrahedron, 17), 0.15, 16);
  const Mesh tangled = test::noisy(test::lattice(ElementType::tetrahedron, 17), 0.5, 17);
  ASSERT_GT(measure_quality(tangled).inverted_count, 100);
  for (const Mesh& mesh : {good, tangled, test::as_float32(good)}) {
    for (const Goal goal : kGoals) {
      const Job one = test::smooth(mesh, optimize(goal), 1);
      for (const int threads : {2, 5}) {
        const Job more = test::smooth(mesh, optimize(goal), threads);
        EXPECT_TRUE(same_bits(one.mesh, more.mesh));
        EXPECT_EQ(one.summary.convergence.iteration_count,
                  more.summary.convergence.iteration_count);
      }
    }
  }
}

TEST(Optimize, DoesNotDependOnTheUnit) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.17, 18);
  const Job job = test::smooth(mesh, optimize());
  for (const double unit : {1e-6, 1e6}) {
    const auto scale = [=](Vec3d p) { return unit * p; };
    const Job scaled = test::smooth(test::mapped(mesh, scale), optimize());
    EXPECT_LT(test::difference(scaled.mesh, test::oracle::to_points(test::mapped(job.mesh, scale))),
              1e-9);
  }
}

TEST(MovementLimit, HoldsEveryMethod) {
  for (const test::Way& way : test::ways(true)) {
    for (const ElementType type : {ElementType::tetrahedron, ElementType::quad}) {
      SCOPED_TRACE(way.name);
      const Mesh mesh = test::noisy(test::lattice(type, 5), 0.17, 19);
      SmoothOptions options{
          .method = way.method, .form = way.form, .max_iterations = 20, .never_worse = false};
      const auto farthest = [&](const Mesh& after) {
        return test::oracle::max_distance(test::oracle::to_points(mesh),
                                          test::oracle::to_points(after));
      };
      const double limit = 0.25 * farthest(test::smooth(mesh, options).mesh);
      options.movement_limit = MovementLimit{.value = limit};

      const Job job = test::smooth(mesh, options);

      EXPECT_LE(farthest(job.mesh), limit * (1 + 1e-12) + 1e-15);
      EXPECT_GE(farthest(job.mesh), limit * 0.9);
      EXPECT_TRUE(is_valid(job.summary.quality_after));
    }
  }
}

TEST(Optimize, LeavesTheWorstElementNoWorseThanBalanced) {
  std::vector<Mesh> meshes;
  for (const ElementType type : kLinearTypes) {
    meshes.push_back(test::noisy(test::lattice(type, 8), 0.3, 6));
  }
  // One bad ball among good ones.
  Mesh& damaged = meshes.emplace_back(test::lattice(ElementType::tetrahedron, 9));
  test::points(damaged)[555] += Vec3d{0.9, 0.05, 0.1};
  const auto smoother = make_smoother("cpu", 2);
  for (const Mesh& mesh : meshes) {
    const std::string name(element_name(mesh.blocks[0].type));
    test::expect_worst_no_worse_than_balanced(*smoother, name, mesh);
  }
}

}  // namespace
}  // namespace meshsmooth
