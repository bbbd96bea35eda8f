// SmoothOptions::never_worse: no method returns what is worse than it got, unless it says so.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random_mesh.hpp"
#include "meshsmooth/error.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using test::points;
using test::RandomMesh;

constexpr double kRounding = 2e-9;

/// Neither least value is lower, nor the mean of the metric in force.
void expect_no_worse(const SmoothSummary& summary, const std::string& name) {
  for (const QualityMetric metric : {QualityMetric::mean_ratio, QualityMetric::scaled_jacobian}) {
    const MetricStats& before = test::stats_of(summary.quality_before, metric);
    const MetricStats& after = test::stats_of(summary.quality_after, metric);
    EXPECT_GE(after.min, before.min - kRounding) << name << ", " << metric_name(metric);
    if (metric != summary.kept_quality.value().metric) continue;
    EXPECT_GE(after.mean, before.mean - 0.001 * std::abs(before.mean) - kRounding) << name;
  }
  EXPECT_LE(summary.quality_after.inverted_count, summary.quality_before.inverted_count) << name;
}

/// Of a way's goal that gives up the mean.
bool is_worst_goal(const Method& method) {
  const auto* const optimize = std::get_if<Optimize>(&method);
  return optimize != nullptr && optimize->goal == Goal::worst;
}

SmoothOptions random_options(const test::Way& way, RandomMesh& random) {
  SmoothOptions options{
      .method = way.method, .form = way.form, .max_iterations = random.pick(1, 30)};
  const int policy = random.pick(0, 4);
  if (policy == 0) options.boundary = BoundaryPolicy::free;
  if (policy >= 3) options.boundary = BoundaryPolicy::slide;
  if (random.pick(0, 4) == 0) options.only_below = OnlyBelow{random.uniform(0.1, 0.9)};
  return options;
}

TEST(NeverWorse, HoldsForEveryMethodOnRandomMeshes) {
  const std::vector<test::Way> ways = test::ways(true);
  std::int64_t restored = 0, moved = 0, curved = 0;
  for (int seed = 0; seed < test::mesh_count(); ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    Mesh mesh = random.valid();
    if (random.pick(0, 2) == 0) mesh = test::waved(mesh, random);
    if (random.pick(0, 2) == 0) mesh = test::wavy_if_surface(mesh);
    if (random.pick(0, 2) == 0 && mesh.node_count() < 60) {
      mesh = test::second_order(mesh, random.pick(0, 1) == 1);
      if (random.pick(0, 1) == 0) mesh = test::noisy(mesh, random.uniform(0, 0.05), 5);
      ++curved;
    }
    if (random.pick(0, 3) == 0) mesh = test::as_float32(mesh);
    if (!test::is_valid(mesh)) continue;
    const test::Way& way = ways[static_cast<std::size_t>(seed) % ways.size()];
    const SmoothOptions options = random_options(way, random);

    const SmoothSummary summary = test::smooth(mesh, options).summary;

    const std::string name = std::to_string(seed) + " " + way.name;
    restored += summary.kept_quality.value().restored_node_count();
    moved += summary.nodes.moved;
    if (!is_worst_goal(way.method)) {
      expect_no_worse(summary, name);
      EXPECT_TRUE(find_lower(summary).empty()) << name;
      continue;
    }
    for (const LowerMeasure& lower : find_lower(summary)) EXPECT_TRUE(lower.mean) << name;
  }
  EXPECT_GT(restored, test::mesh_count() / 4);
  EXPECT_GT(moved, 4 * test::mesh_count());
  EXPECT_GT(curved, test::mesh_count() / 20);
}

/// A thin ring, three quarters of it: averaging pulls nodes across.
Mesh ring(int n) {
  return test::mapped(test::lattice(ElementType::triangle, n), [&](Vec3d p) {
    const double angle = 4.7 * p.x / n, radius = 1 + 0.8 * p.y / n;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), 0};
  });
}

TEST(NeverWorse, OffNamesTheMethodAlone) {
  SmoothOptions options{.method = Laplacian{}};
  const test::Job kept = test::smooth(ring(9), options);
  options.never_worse = false;
  const test::Job off = test::smooth(ring(9), options);

  EXPECT_FALSE(off.summary.kept_quality);
  const std::vector<LowerMeasure> lower = find_lower(off.summary);
  ASSERT_FALSE(lower.empty());
  EXPECT_EQ(lower[0].metric, QualityMetric::mean_ratio);
  EXPECT_FALSE(lower[0].mean);
  EXPECT_LT(lower[0].after, lower[0].before);
  EXPECT_GT(kept.summary.kept_quality.value().for_mean_ratio, 0);
  EXPECT_TRUE(find_lower(kept.summary).empty());
  EXPECT_EQ(kept.summary.nodes.moved + kept.summary.kept_quality->restored_node_count(),
            off.summary.nodes.moved);
}

TEST(NeverWorse, CostsNoBitWhereNothingIsWorse) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 7), 0.3, 2);
    SmoothOptions options;
    const test::Job kept = test::smooth(mesh, options);
    options.never_worse = false;

    const test::Job off = test::smooth(mesh, options);

    if (kept.summary.kept_quality.value().restored_node_count() > 0) continue;
    EXPECT_TRUE(test::same_bits(kept.mesh, off.mesh)) << element_name(type);
    EXPECT_TRUE(find_lower(off.summary).empty()) << element_name(type);
  }
}

TEST(NeverWorse, DoesNotDependOnWhatIsReported) {
  for (const bool curved : {false, true}) {
    Mesh mesh = ring(9);
    if (curved) mesh = test::noisy(test::second_order(mesh), 0.01, 3);
    SmoothOptions options{.method = Laplacian{}};
    const test::Job full = test::smooth(mesh, options);
    options.quality_detail = QualityDetail::brief;

    const test::Job brief = test::smooth(mesh, options);

    EXPECT_TRUE(test::same_bits(full.mesh, brief.mesh));
    test::expect_brief_of(full.summary.quality_before, brief.summary.quality_before);
    test::expect_brief_of(full.summary.quality_after, brief.summary.quality_after);
    const std::int64_t restored = full.summary.kept_quality.value().restored_node_count();
    EXPECT_TRUE(curved || restored > 0);
    EXPECT_EQ(restored, brief.summary.kept_quality.value().restored_node_count());
  }
}

TEST(NeverWorse, KeepsWhatTheMetricNames) {
  // Flat layers at right angles: the mean ratio rises where angles are given up.
  const Mesh mesh =
      test::mapped(test::noisy(test::lattice(ElementType::hexahedron, 6), 0.05, 1), [](Vec3d p) {
        return Vec3d{p.x, p.y, 0.4 * p.z * p.z};
      });
  for (const QualityMetric metric : {QualityMetric::mean_ratio, QualityMetric::scaled_jacobian}) {
    SmoothOptions options{.method = Laplacian{}};
    options.metric = metric;

    const SmoothSummary summary = test::smooth(mesh, options).summary;

    const MetricStats& before = test::stats_of(summary.quality_before, metric);
    const MetricStats& after = test::stats_of(summary.quality_after, metric);
    EXPECT_EQ(summary.kept_quality.value().metric, metric);
    EXPECT_GE(after.min, before.min - kRounding) << metric_name(metric);
    EXPECT_GE(after.mean, 0.999 * before.mean) << metric_name(metric);
  }
}

/// The worst element is locked and hides what happens to the others.
TEST(NeverWorse, LooksBehindLockedElements) {
  Mesh mesh = ring(9);
  const SmoothOptions options{.method = Laplacian{}};
  const test::Job alone = test::smooth(mesh, options);
  ASSERT_GT(alone.summary.kept_quality.value().restored_node_count(), 0);
  const auto first = static_cast<NodeId>(mesh.node_count());
  for (const Vec3d& p : {Vec3d{5, 0, 0}, Vec3d{6, 0, 0}, Vec3d{5.5, 0.01, 0}}) {
    points(mesh).push_back(p);
  }
  for (NodeId n = 0; n < 3; ++n) mesh.blocks[0].nodes.push_back(first + n);

  const test::Job beside = test::smooth(mesh, options);

  for (NodeId n = 0; n < first; ++n) {
    ASSERT_EQ(points(beside.mesh)[static_cast<std::size_t>(n)],
              points(alone.mesh)[static_cast<std::size_t>(n)]);
  }
  EXPECT_EQ(beside.summary.kept_quality.value().restored_node_count(),
            alone.summary.kept_quality.value().restored_node_count());
}

TEST(NeverWorse, UndoesNoUntangling) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 6), 0.6, 4);
    SmoothOptions options;
    const test::Job kept = test::smooth(mesh, options);
    options.never_worse = false;

    const test::Job off = test::smooth(mesh, options);

    const std::int64_t tangled = off.summary.quality_before.inverted_count;
    EXPECT_GT(tangled, 0) << element_name(type);
    EXPECT_EQ(kept.summary.quality_after.inverted_count, off.summary.quality_after.inverted_count)
        << element_name(type);
  }
}

/// A sector of `cells` rings and spokes around an axis, its edges on arcs.
Mesh sector(ElementType type, int cells, bool full, double degrees) {
  return test::mapped(test::second_order(test::lattice(type, cells), full), [&](Vec3d p) {
    const double angle = p.x / cells * degrees * std::numbers::pi / 180;
    const double radius = 5 + 3 * p.y;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), 0.7 * p.z};
  });
}

TEST(NeverWorse, LeavesCurvedSectorsOfBoxesAsTheyAre) {
  for (const ElementType type : {ElementType::quad, ElementType::hexahedron}) {
    for (const bool full : {false, true}) {
      for (const double degrees : {10.0, 45.0, 90.0}) {
        const Mesh mesh = sector(type, 4, full, degrees);
        for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
          const test::Job job = test::smooth(mesh, {.method = Optimize{.goal = goal}});
          EXPECT_EQ(job.summary.nodes.moved, 0) << element_name(type) << full << " " << degrees;
          EXPECT_EQ(job.summary.kept_quality.value().restored_node_count(), 0);
        }
      }
    }
  }
}

TEST(NeverWorse, PoorElementsAreThoseOfTheResult) {
  for (const bool curved : {false, true}) {
    int restored = 0;
    for (const ElementType type : kLinearTypes) {
      // Flat layers at right angles: their least scaled Jacobian falls where they grow.
      Mesh mesh = test::mapped(test::noisy(test::lattice(type, 4), 0.1, 1), [](Vec3d p) {
        return Vec3d{p.x, 0.3 * p.y * p.y + 0.1 * p.y, 0.4 * p.z * p.z + 0.1 * p.z};
      });
      if (curved) mesh = test::noisy(test::second_order(mesh), 0.02, 3);
      SmoothOptions options{.method = Optimize{.goal = Goal::average, .target = Target::ideal},
                            .report_below = 0.8};
      const test::Job job = test::smooth(mesh, options);
      restored += job.summary.kept_quality.value().restored_node_count() > 0 ? 1 : 0;
      options.max_iterations = 0;  // a job without sweeps reports the mesh that it gets

      const PoorElements expected = test::smooth(job.mesh, options).summary.poor.value();

      const PoorElements poor = job.summary.poor.value();
      const std::string name = std::string(element_name(type)) + (curved ? " curved" : "");
      EXPECT_EQ(poor.element_count, expected.element_count) << name;
      EXPECT_EQ(poor.locked_count, expected.locked_count) << name;
      EXPECT_EQ(poor.limited_count, expected.limited_count) << name;
    }
    EXPECT_GE(restored, 3);
  }
}

TEST(NeverWorse, NamesOneOfTwoMetrics) {
  SmoothOptions options;
  options.metric = QualityMetric::radius_ratio;
  EXPECT_THROW(validate(options), InvalidOption);
  options.metric = QualityMetric::scaled_jacobian;
  EXPECT_NO_THROW(validate(options));
  options.method = Move{};
  EXPECT_THROW(validate(options), NotSupported);
}

}  // namespace
}  // namespace meshsmooth
