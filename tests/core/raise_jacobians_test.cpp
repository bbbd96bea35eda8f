// The metric that the caller names decides what the optimizer raises.

#include <gtest/gtest.h>

#include <cmath>

#include "core/smoothing.hpp"
#include "meshsmooth/method_traits.hpp"

namespace meshsmooth {
namespace {

using test::Job;

SmoothOptions raising(Goal goal, BoundaryPolicy boundary = BoundaryPolicy::fixed) {
  return {.method = Optimize{goal}, .boundary = boundary, .metric = QualityMetric::scaled_jacobian};
}

double least(const Job& job) { return test::scaled_jacobian(job.summary.quality_after).min; }

/// A block curved to a horseshoe, whose elements are not regular at best.
Mesh rough(ElementType type, unsigned seed) {
  const bool surface = element_shape(type).dimension == 2;
  const int n = surface ? 12 : 5;
  return test::mapped(test::noisy(test::lattice(type, n), 0.2, seed), [=](Vec3d p) {
    const double angle = p.x / n * 4, radius = 0.3 + p.y / n;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), surface ? 0.0 : p.z / n};
  });
}

class RaiseJacobiansOf : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Optimize, RaiseJacobiansOf, testing::ValuesIn(kLinearTypes));

/// Of simplices `balanced` keeps the mean of the metric too, which may take moves back.
TEST_P(RaiseJacobiansOf, LiftsTheLeastOne) {
  const bool simplex =
      GetParam() == ElementType::tetrahedron || GetParam() == ElementType::triangle;
  double without = 0, with = 0;
  for (const Goal goal : {Goal::balanced, Goal::worst}) {
    if (simplex && goal == Goal::balanced) continue;
    for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
      const Mesh mesh = rough(GetParam(), 1);
      SmoothOptions options = raising(goal, boundary);
      const Job raised = test::smooth(mesh, options);
      options.metric = QualityMetric::mean_ratio;
      const Job plain = test::smooth(mesh, options);
      EXPECT_EQ(raised.summary.quality_after.inverted_count, 0);
      EXPECT_EQ(raised.summary.quality_after.degenerate_count, 0);
      EXPECT_EQ(raised.summary.stop_reason, StopReason::converged);
      EXPECT_GE(least(raised), least(plain) - 1e-9);
      without += least(plain);
      with += least(raised);
    }
  }
  EXPECT_GT(with, without + 0.01);
}

TEST(RaiseJacobians, IsForTheGoalsThatAskForIt) {
  const Mesh mesh = rough(ElementType::hexahedron, 1);
  SmoothOptions options = raising(Goal::average);
  const Job average = test::smooth(mesh, options);
  options.metric = {};
  EXPECT_TRUE(test::same_bits(average.mesh, test::smooth(mesh, options).mesh));
}

TEST(RaiseJacobians, KeepsWhatIsFixedAndTheMovementLimit) {
  Mesh mesh = rough(ElementType::hexahedron, 2);
  mesh.fixed.assign(mesh.node_count(), 0);
  for (std::size_t n = 0; n < mesh.node_count(); n += 3) mesh.fixed[n] = 1;
  SmoothOptions options = raising(Goal::worst, BoundaryPolicy::slide);
  options.movement_limit = MovementLimit{.value = 0.01, .relative = false};
  const Job job = test::smooth(mesh, options);
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    const Vec3d from = test::points(mesh)[n], to = test::points(job.mesh)[n];
    if (mesh.fixed[n] != 0) {
      EXPECT_EQ(from, to);
    }
    EXPECT_LE(norm(to - from), 0.01 * (1 + 1e-9));
  }
}

TEST(RaiseJacobians, StaysInThePlane) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const Job job = test::smooth(rough(type, 1), raising(Goal::worst, BoundaryPolicy::slide));
    for (const Vec3d p : test::points(job.mesh)) EXPECT_EQ(p.z, 0);
  }
}

TEST(RaiseJacobians, GivesTheSameBitsWithAnyNumberOfThreads) {
  const Mesh mesh = rough(ElementType::wedge, 3);
  EXPECT_TRUE(test::same_bits(test::smooth(mesh, raising(Goal::worst), 1).mesh,
                              test::smooth(mesh, raising(Goal::worst), 4).mesh));
}

TEST(RaiseJacobians, LeavesAMeshThatIsAtItsBest) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::lattice(type, 4);
    const Job job = test::smooth(mesh, raising(Goal::balanced));
    EXPECT_GE(least(job), test::scaled_jacobian(job.summary.quality_before).min - 1e-9)
        << element_name(type);
  }
}

}  // namespace
}  // namespace meshsmooth
