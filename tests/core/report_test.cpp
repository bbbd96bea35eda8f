// What a job tells about its end: the rule, what is left to gain, what holds poor elements.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

using test::Job;

Mesh noisy_tetrahedra() { return test::noisy(test::lattice(ElementType::tetrahedron, 8), 0.25, 6); }

EndRule rule_of(const Mesh& mesh, const SmoothOptions& options) {
  return test::smooth(mesh, options).summary.convergence.end_rule;
}

TEST(EndRule, NamesTheRuleThatEndedTheJob) {
  const Mesh mesh = noisy_tetrahedra();
  EXPECT_EQ(rule_of(mesh, {}), EndRule::small_gains);
  EXPECT_EQ(rule_of(mesh, {.tolerance = {.value = 0.01, .relative = false}}), EndRule::small_moves);
  EXPECT_EQ(rule_of(mesh, {.method = Laplacian{}}), EndRule::small_moves);
  EXPECT_EQ(rule_of(mesh, {.max_iterations = 2}), EndRule::none);
  EXPECT_EQ(rule_of(test::lattice(ElementType::hexahedron, 4), {}), EndRule::at_rest);

  // A node with its whole surroundings fixed lies on the wrong side of them.
  Mesh stuck = test::lattice(ElementType::tetrahedron, 2);
  test::points(stuck)[13] += Vec3d{5, 0, 0};
  test::points(stuck)[0] = test::points(stuck)[26];
  const Job job = test::smooth(stuck, {});
  EXPECT_EQ(job.summary.stop_reason, StopReason::stagnated);
  EXPECT_EQ(job.summary.convergence.end_rule, EndRule::no_progress);
}

TEST(RemainingGain, ShrinksWithTheTolerance) {
  const Mesh mesh = noisy_tetrahedra();
  double last = 1;
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    const Job job = test::smooth(mesh, {.tolerance = {.value = tolerance}});
    const std::optional<double>& left = job.summary.convergence.remaining_gain;
    ASSERT_TRUE(left) << tolerance;
    EXPECT_LT(*left, last);
    EXPECT_LT(*left, 5 * tolerance);
    last = *left;
  }
  EXPECT_FALSE(test::smooth(mesh, {.method = Laplacian{}}).summary.convergence.remaining_gain);
}

TEST(PoorElements, AreCountedByWhatHoldsThem) {
  const Mesh mesh = noisy_tetrahedra();
  const double below = 0.9;  // the regular lattice, the optimum, has 0.84
  const auto run = [&](SmoothOptions options) {
    options.element_quality_metrics = {QualityMetric::mean_ratio};
    const Job without = test::smooth(mesh, options);
    options.report_below = below;
    const Job job = test::smooth(mesh, options);
    EXPECT_TRUE(test::same_bits(job.mesh, without.mesh));
    EXPECT_FALSE(without.summary.poor);
    const auto& ratios = job.summary.element_quality.values;
    EXPECT_EQ(job.summary.poor->element_count,
              std::ranges::count_if(ratios, [=](float ratio) { return ratio < below; }));
    return *job.summary.poor;
  };
  const PoorElements early = run({.max_iterations = 1});
  const PoorElements late = run({.max_iterations = 200, .tolerance = {.value = 1e-9}});
  EXPECT_LT(early.limited_count, early.element_count / 4);
  EXPECT_GT(late.limited_count, 0);
  EXPECT_EQ(late.limited_count + late.locked_count, late.element_count);

  const PoorElements fixed = run({.only_below = OnlyBelow{.quality = 1e-3, .rings = 0}});
  EXPECT_EQ(fixed.locked_count, fixed.element_count);
  const PoorElements evaluated = run({.max_iterations = 0});
  EXPECT_GT(evaluated.element_count, 0);
  EXPECT_LT(evaluated.limited_count, evaluated.element_count / 4);
}

TEST(PoorElements, AreRefusedByNameWhereNothingTellsThem) {
  const Mesh mesh = noisy_tetrahedra();
  const auto reason = [&](const SmoothOptions& options) -> std::string {
    try {
      test::smooth(mesh, options);
    } catch (const Error& error) {
      return error.reason();
    }
    return "nothing";
  };
  EXPECT_EQ(reason({.report_below = 0}), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason({.report_below = 1.5}), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason({.method = Laplacian{}, .report_below = 0.5}), "OPTION_NOT_SUPPORTED");
}

}  // namespace
}  // namespace meshsmooth
