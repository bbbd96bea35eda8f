// Nodes of the boundary, and between regions, that slide.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/cells.hpp"

namespace meshsmooth {
namespace {

using test::Cells;
using test::Job;
using test::points;
using test::same_bits;

bool is_valid(const QualityStats& quality) {
  return quality.inverted_count == 0 && quality.degenerate_count == 0;
}

double mean_of_mean_ratios(const QualityStats& quality) {
  for (const MetricStats& stats : quality.metrics) {
    if (stats.metric == QualityMetric::mean_ratio) return stats.mean;
  }
  throw std::logic_error("no mean ratio");
}

SmoothOptions sliding(const Method& method = Optimize{}, Form form = Form::automatic) {
  return {.method = method, .form = form, .max_iterations = 40, .boundary = BoundaryPolicy::slide};
}

/// One block, a step with an edge that goes inwards, a hole, two regions, four around a line.
std::vector<std::pair<std::string, Cells::Region>> shapes(int n) {
  const int half = n / 2;
  return {
      {"cube", [](int, int, int) { return 0; }},
      {"step", [=](int x, int, int z) { return x >= half && z >= half ? Cells::kNone : 0; }},
      {"notch", [=](int x, int y, int z) { return x >= half && y >= half && z >= half ? -1 : 0; }},
      {"two_regions", [=](int x, int, int) { return x < half ? 7 : 3; }},
      {"part_in_part",
       [=](int x, int y, int z) { return x >= half && y >= half && z >= half ? 1 : 2; }},
      {"four_regions", [=](int x, int y, int) { return (x < half ? 0 : 1) + (y < half ? 0 : 5); }}};
}

/// As far thrown about as leaves it valid.
Mesh valid_mesh(const Cells& cells, unsigned seed, double size = 0.3) {
  for (;; size *= 0.8) {
    Mesh mesh = cells.thrown(size, seed);
    if (is_valid(measure_quality(mesh))) return mesh;
  }
}

double coordinate(const Vec3d& p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

/// How many coordinates that must not change have another value.
int strayed(const Cells& cells, const Mesh& before, const Mesh& after) {
  const std::vector<Vec3d> x = test::points_as_double(before), y = test::points_as_double(after);
  int count = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool same = coordinate(x[n], axis) == coordinate(y[n], axis);
      if (!same && !cells.may_move(n, axis)) ++count;
    }
  }
  return count;
}

/// Nodes with as many freedoms that have moved.
int moved(const Cells& cells, int freedoms, const Mesh& before, const Mesh& after) {
  const std::vector<Vec3d> x = test::points_as_double(before), y = test::points_as_double(after);
  int count = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    if (cells.freedoms(n) == freedoms && !(x[n] == y[n])) ++count;
  }
  return count;
}

class SlidingWay : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Slide, SlidingWay, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(SlidingWay, KeepsPlanesCreasesAndCornersToTheBit) {
  for (const ElementType type : kElementTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_shape(type).name));
      const Cells cells(type, 4, region);
      const Mesh mesh = valid_mesh(cells, 1);

      const Job job = test::smooth(mesh, sliding(GetParam().method, GetParam().form));

      EXPECT_EQ(strayed(cells, mesh, job.mesh), 0);
      EXPECT_TRUE(is_valid(job.summary.quality_after));
      EXPECT_NEAR(job.summary.quality_after.sum_absolute_volume,
                  measure_quality(cells.mesh()).sum_absolute_volume, 1e-12 * 64);
      EXPECT_GT(moved(cells, 1, mesh, job.mesh), 0);
      if (!test::oracle::is_surface(type)) {
        EXPECT_GT(moved(cells, 2, mesh, job.mesh), 0);
      }
    }
  }
}

TEST_P(SlidingWay, StaysValidOnARotatedPlane) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())).toRotationMatrix();
  for (const ElementType type : kElementTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_shape(type).name));
      const Cells cells(type, 4, region);
      const auto turned = [&](const Eigen::Matrix3d& by, const Mesh& mesh) {
        return test::mapped(mesh, [&](Vec3d p) {
          const Eigen::Vector3d q = by * test::oracle::to_point(p);
          return Vec3d{q.x(), q.y(), q.z()};
        });
      };
      const Mesh mesh = valid_mesh(cells, 2);

      const Job job = test::smooth(turned(turn, mesh), sliding(GetParam().method, GetParam().form));

      const Mesh back = turned(turn.transpose(), job.mesh);
      double farthest = 0;
      for (std::size_t n = 0; n < mesh.node_count(); ++n) {
        for (int axis = 0; axis < 3; ++axis) {
          if (cells.may_move(n, axis)) continue;
          farthest = std::max(farthest, std::abs(coordinate(points(back)[n], axis) -
                                                 coordinate(points(mesh)[n], axis)));
        }
      }
      EXPECT_LT(farthest, 1e-12 * test::diagonal(mesh));
      EXPECT_TRUE(is_valid(job.summary.quality_after));
      EXPECT_NEAR(job.summary.quality_after.sum_absolute_volume,
                  measure_quality(mesh).sum_absolute_volume, 1e-12 * 64);
      EXPECT_GT(job.summary.nodes.sliding_on_line, 0);
      EXPECT_GT(moved(cells, 1, mesh, back), 0);
    }
  }
}

TEST(Slide, CountsWhatItFinds) {
  for (const ElementType type : kElementTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_shape(type).name));
      const Cells cells(type, 4, region);
      const std::vector<bool> used = cells.used();
      const bool flat = test::oracle::is_surface(type);
      std::int64_t in_plane = 0, on_line = 0, fixed = 0;
      for (std::size_t n = 0; n < used.size(); ++n) {
        if (!used[n]) continue;
        fixed += cells.freedoms(n) == 0 ? 1 : 0;
        on_line += cells.freedoms(n) == 1 ? 1 : 0;
        in_plane += !flat && cells.freedoms(n) == 2 ? 1 : 0;
      }

      const NodeCounts counts = test::smooth(valid_mesh(cells, 3), sliding()).summary.nodes;

      EXPECT_EQ(counts.sliding_in_plane, in_plane);
      EXPECT_EQ(counts.sliding_on_line, on_line);
      EXPECT_EQ(counts.fixed, fixed);
      EXPECT_EQ(counts.curved, 0);
    }
  }
}

TEST(Slide, MakesABetterMeshThanAFixedBoundary) {
  for (const ElementType type : kElementTypes) {
    const Cells cells(type, 5, [](int, int, int) { return 0; });
    const Mesh mesh = valid_mesh(cells, 4, 0.35);
    SmoothOptions fixed = sliding();
    fixed.boundary = BoundaryPolicy::fixed;

    const Job slid = test::smooth(mesh, sliding());
    const Job held = test::smooth(mesh, fixed);

    EXPECT_GT(mean_of_mean_ratios(slid.summary.quality_after),
              mean_of_mean_ratios(held.summary.quality_after) + 0.02)
        << element_shape(type).name;
  }
}

}  // namespace
}  // namespace meshsmooth
