// Optimize on curved surface meshes: nodes stay on the input, on its feature edges and corners.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "support/input_surface.hpp"
#include "support/surfaces.hpp"

namespace meshsmooth {
namespace {

using test::bracket;
using test::Grid;
using test::InputSurface;
using test::Job;
using test::kFold;
using test::kLength;
using test::kProfile;
using test::points;
using test::surfaces;
using test::torus;
using test::oracle::to_point;

double least_angle(const Mesh& mesh) {
  double least = 180;
  const test::oracle::Points x = test::oracle::to_points(mesh);
  for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
    const test::oracle::Points p = test::oracle::corners(e, x);
    for (std::size_t k = 0; k < p.size(); ++k) {
      least =
          std::min(least, test::oracle::degrees_between(p[(k + 1) % p.size()] - p[k],
                                                        p[(k + p.size() - 1) % p.size()] - p[k]));
    }
  }
  return least;
}

double off(const Mesh& input, const Mesh& result) {
  const InputSurface surface(input);
  double farthest = 0;
  for (const Vec3d& p : test::points_as_double(result)) {
    farthest = std::max(farthest, surface.distance(to_point(p)));
  }
  return farthest;
}

TEST(OnSurface, ImprovesAnglesAndStaysOnTheInput) {
  for (const auto& [name, mesh] : surfaces()) {
    for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
      SCOPED_TRACE(name);
      const Job job = test::smooth(mesh, {.method = Optimize{.goal = goal}, .history = true});

      EXPECT_GT(least_angle(job.mesh), least_angle(mesh) + 5);
      EXPECT_LE(off(mesh, job.mesh), job.summary.deviation.tolerance);
      EXPECT_LE(job.summary.deviation.result_to_input, job.summary.deviation.tolerance);
      EXPECT_LT(job.summary.deviation.tolerance, 1e-12 * test::diagonal(mesh));
      EXPECT_GT(job.summary.deviation.input_to_result, 0);
      EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
      const NodeCounts& nodes = job.summary.nodes;
      EXPECT_EQ(nodes.sliding_on_surface + nodes.sliding_on_curve, nodes.total - nodes.fixed);
      if (goal == Goal::worst) continue;  // its phases have energies of their own
      const std::vector<double>& energies = job.summary.convergence.energies;
      EXPECT_TRUE(std::is_sorted(energies.rbegin(), energies.rend()));
    }
  }
}

TEST(OnSurface, KeepsItsPromisesInFloat32) {
  for (const auto& [name, mesh] : surfaces()) {
    SCOPED_TRACE(name);
    const Mesh rounded = test::as_float32(mesh);
    const Job job = test::smooth(rounded, {});

    EXPECT_GT(least_angle(job.mesh), least_angle(mesh) + 5);
    EXPECT_LE(off(rounded, job.mesh), job.summary.deviation.tolerance);
    EXPECT_LT(job.summary.deviation.tolerance, 1e-6 * test::diagonal(mesh));
  }
}

TEST(OnSurface, KeepsFeatureEdgesAndCorners) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    for (const BoundaryPolicy boundary :
         {BoundaryPolicy::fixed, BoundaryPolicy::slide, BoundaryPolicy::free}) {
      const Mesh mesh = bracket(type);
      const Job job = test::smooth(mesh, {.boundary = boundary});

      const Grid grid{kProfile, kLength, false, false};
      // To the polyline of a line of the grid.
      const auto distance = [&](bool column, int line, NodeId node) {
        double least = HUGE_VAL;
        for (int k = 0; k < (column ? kLength : kProfile); ++k) {
          const NodeId a = column ? grid.at(line, k) : grid.at(k, line);
          const NodeId b = column ? grid.at(line, k + 1) : grid.at(k + 1, line);
          least = std::min(
              least, test::distance_to_segment(to_point(points(mesh)[a]), to_point(points(mesh)[b]),
                                               to_point(points(job.mesh)[node])));
        }
        return least;
      };
      const auto moved = [&](NodeId node) {
        return !(points(mesh)[node] == points(job.mesh)[node]);
      };
      int along_fold = 0, along_ends = 0;
      for (int j = 0; j <= kLength; ++j) {
        EXPECT_LE(distance(true, kFold, grid.at(kFold, j)), 1e-12);
        for (const int side : {0, kProfile}) {
          EXPECT_LE(distance(true, side, grid.at(side, j)), 1e-12);
          along_ends += moved(grid.at(side, j)) ? 1 : 0;
        }
        along_fold += moved(grid.at(kFold, j)) ? 1 : 0;
      }
      for (int i = 0; i <= kProfile; ++i) {
        for (const int end : {0, kLength}) EXPECT_LE(distance(false, end, grid.at(i, end)), 1e-12);
      }
      for (const int i : {0, kFold, kProfile}) {
        for (const int j : {0, kLength}) EXPECT_FALSE(moved(grid.at(i, j)));
      }
      EXPECT_GT(along_fold, kLength / 2);
      EXPECT_EQ(along_ends > 0, boundary != BoundaryPolicy::fixed);
    }
  }
}

TEST(OnSurface, TakesTheFeatureAngleFromTheOptions) {
  const Mesh mesh = bracket(ElementType::quad);
  const auto on_curve = [&](double angle) {
    return test::smooth(mesh, {.feature_angle = angle}).summary.nodes.sliding_on_curve;
  };
  EXPECT_EQ(on_curve(30), kLength - 1);
  EXPECT_GT(on_curve(15), kLength - 1);  // the facets of the rounding turn by 22.5 degrees
}

TEST(OnSurface, KeepsTheNodesOfTheCallerAndBetweenRegions) {
  Mesh mesh = torus(ElementType::quad);
  for (std::size_t n = 0; n < mesh.node_count(); ++n) mesh.fixed.push_back(n % 7 == 0 ? 1 : 0);
  mesh.regions.assign(mesh.element_count(), 1);
  std::fill_n(mesh.regions.begin(), mesh.element_count() / 2, 2);
  const Grid grid{48, 24, true, true};

  for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
    const Job job = test::smooth(mesh, {.boundary = boundary});

    for (std::size_t n = 0; n < mesh.node_count(); n += 7) {
      EXPECT_EQ(points(job.mesh)[n], points(mesh)[n]);
    }
    EXPECT_EQ(job.summary.nodes.between_regions, 2 * 48);
    EXPECT_LE(off(mesh, job.mesh), job.summary.deviation.tolerance);
    const auto on_line = [&](const Vec3d& p) {
      double least = HUGE_VAL;
      for (const int row : {0, 12}) {
        for (int i = 0; i < 48; ++i) {
          least = std::min(least, test::distance_to_segment(
                                      to_point(points(mesh)[grid.at(i, row)]),
                                      to_point(points(mesh)[grid.at(i + 1, row)]), to_point(p)));
        }
      }
      return least;
    };
    for (int i = 0; i < 48; ++i) {
      for (const int row : {0, 12}) EXPECT_LE(on_line(points(job.mesh)[grid.at(i, row)]), 1e-12);
    }
  }
}

TEST(OnSurface, HoldsMovementLimitsAndRepairsFolds) {
  const Mesh mesh = torus(ElementType::triangle, 0.75);
  const Job job = test::smooth(mesh, {.movement_limit = MovementLimit{.value = 0.05}});
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    EXPECT_LE(norm(points(job.mesh)[n] - points(mesh)[n]), 0.05 * (1 + 1e-12));
  }
  EXPECT_LE(off(mesh, job.mesh), job.summary.deviation.tolerance);
}

TEST(OnSurface, LeavesPlaneMeshesAsTheyWere) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const Mesh mesh = test::noisy(test::lattice(type, 12), 0.25, 3);
    const Job job = test::smooth(mesh, {});

    EXPECT_EQ(job.summary.deviation.tolerance, 0);
    EXPECT_EQ(job.summary.nodes.sliding_on_surface, 0);
  }
}

TEST(OnSurface, GivesTheSameBitsOnAnyNumberOfThreads) {
  const Mesh mesh = bracket(ElementType::triangle);
  const Mesh one = test::smooth(mesh, {}, 1).mesh;
  EXPECT_TRUE(test::same_bits(one, test::smooth(mesh, {}, 2).mesh));
  EXPECT_TRUE(test::same_bits(one, test::smooth(mesh, {}, 5).mesh));
}

}  // namespace
}  // namespace meshsmooth
