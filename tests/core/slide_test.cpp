// Nodes of the boundary, and between regions, that slide.

#include <gmock/gmock.h>

#include <map>
#include <numbers>
#include <set>

#include "core/smoothing.hpp"
#include "support/cells.hpp"

namespace meshsmooth {
namespace {

using test::Cells;
using test::Job;
using test::mean_ratio;
using test::points;
using test::same_bits;
using test::shapes;

bool is_valid(const QualityStats& quality) {
  return quality.inverted_count == 0 && quality.degenerate_count == 0;
}

SmoothOptions sliding(const Method& method = Optimize{}, Form form = Form::automatic) {
  return {.method = method,
          .form = form,
          .max_iterations = 40,
          .boundary = BoundaryPolicy::slide,
          .never_worse = false};
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
int off_input(const Cells& cells, const Mesh& before, const Mesh& after) {
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

class SlidingWay : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Slide, SlidingWay, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(SlidingWay, KeepsPlanesCreasesAndCornersToTheBit) {
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
      const Cells cells(type, 4, region);
      const Mesh mesh = valid_mesh(cells, 1);

      const Job job = test::smooth(mesh, sliding(GetParam().method, GetParam().form));

      EXPECT_EQ(off_input(cells, mesh, job.mesh), 0);
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
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
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
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
      const Cells cells(type, 4, region);
      const std::vector<bool> used = cells.used();
      const bool flat = test::oracle::is_surface(type);
      std::int64_t in_plane = 0, on_line = 0, fixed = 0;
      for (std::size_t n = 0; n < used.size(); ++n) {
        if (!used[n]) continue;
        fixed += cells.node_constraints(n) == 0 ? 1 : 0;
        on_line += cells.node_constraints(n) == 1 ? 1 : 0;
        in_plane += !flat && cells.node_constraints(n) == 2 ? 1 : 0;
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
  for (const ElementType type : kLinearTypes) {
    const Cells cells(type, 5, [](int, int, int) { return 0; });
    const Mesh mesh = valid_mesh(cells, 4, 0.35);
    SmoothOptions fixed = sliding();
    fixed.boundary = BoundaryPolicy::fixed;

    const Job slid = test::smooth(mesh, sliding());
    const Job held = test::smooth(mesh, fixed);

    EXPECT_GT(mean_ratio(slid.summary.quality_after).mean,
              mean_ratio(held.summary.quality_after).mean + 0.02)
        << element_name(type);
  }
}

TEST(Slide, GivesTheSameBitsOnAnyNumberOfThreads) {
  const Cells cells(ElementType::tetrahedron, 17, shapes(17)[4].second);
  const Mesh mesh = valid_mesh(cells, 5);
  for (const Method& method : std::vector<Method>{Optimize{}, SmartLaplacian{}, Laplacian{}}) {
    const Mesh one = test::smooth(mesh, sliding(method), 1).mesh;
    EXPECT_TRUE(same_bits(one, test::smooth(mesh, sliding(method), 2).mesh));
    EXPECT_TRUE(same_bits(one, test::smooth(mesh, sliding(method), 5).mesh));
  }
}

TEST(Slide, KeepsTheCallersNodesAndTheMovementLimit) {
  const Cells cells(ElementType::hexahedron, 4, shapes(4)[0].second);
  Mesh mesh = valid_mesh(cells, 6);
  for (std::size_t n = 0; n < mesh.node_count(); ++n) mesh.fixed.push_back(n % 3 == 0 ? 1 : 0);
  SmoothOptions options = sliding();
  options.movement_limit = MovementLimit{.value = 0.05};

  const Job job = test::smooth(mesh, options);

  double farthest = 0;
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    const double way = norm(points(job.mesh)[n] - points(mesh)[n]);
    farthest = std::max(farthest, way);
    if (mesh.fixed[n] != 0) {
      EXPECT_EQ(way, 0);
    }
  }
  EXPECT_GT(farthest, 0.049);
  EXPECT_LE(farthest, 0.05 * (1 + 1e-12));
  EXPECT_EQ(off_input(cells, mesh, job.mesh), 0);
}

/// Only nodes with `inner` node_constraints are thrown about, until an element is inverted.
Mesh tangled_inside(const Cells& cells, int inner, unsigned seed = 7, double size = 0.7) {
  for (;; size *= 1.2) {
    Mesh mesh = cells.thrown(size, seed);
    for (std::size_t n = 0; n < mesh.node_count(); ++n) {
      if (cells.node_constraints(n) < inner) points(mesh)[n] = points(cells.mesh())[n];
    }
    if (measure_quality(mesh).inverted_count > 0) return mesh;
  }
}

TEST(Slide, UntanglesInsideAPlaneBoundary) {
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
      const Cells cells(type, 4, region);
      const Mesh mesh = tangled_inside(cells, test::oracle::is_surface(type) ? 2 : 3);
      SmoothOptions options = sliding();
      options.max_iterations = 300;

      const Job job = test::smooth(mesh, options);

      EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
      EXPECT_EQ(off_input(cells, mesh, job.mesh), 0);
      EXPECT_NEAR(job.summary.quality_after.sum_absolute_volume,
                  measure_quality(cells.mesh()).sum_absolute_volume, 1e-12 * 64);
    }
  }
}

/// The areas of all triangles on the boundary of tetrahedra.
double boundary_area(const Mesh& mesh) {
  std::map<std::set<NodeId>, int> uses;
  const std::vector<NodeId>& nodes = mesh.blocks[0].nodes;
  for (std::size_t e = 0; e < nodes.size(); e += 4) {
    for (std::size_t skipped = 0; skipped < 4; ++skipped) {
      std::set<NodeId> facet(&nodes[e], &nodes[e] + 4);
      facet.erase(nodes[e + skipped]);
      ++uses[facet];
    }
  }
  double area = 0;
  for (const auto& [facet, count] : uses) {
    if (count != 1) continue;
    const std::vector<NodeId> corner(facet.begin(), facet.end());
    const Vec3d a = points(mesh)[corner[0]];
    area += norm(cross(points(mesh)[corner[1]] - a, points(mesh)[corner[2]] - a)) / 2;
  }
  return area;
}

TEST(Slide, FoldsNoFacetOnTheWayOutOfATangle) {
  for (const auto& [name, region] : shapes(4)) {
    const Cells cells(ElementType::tetrahedron, 4, region);
    const double area = boundary_area(cells.mesh());
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Mesh mesh = tangled_inside(cells, 3, seed, 2.0);
      for (const int sweeps : {1, 3}) {
        SmoothOptions options = sliding();
        options.guard = false;
        options.max_iterations = sweeps;
        EXPECT_NEAR(boundary_area(test::smooth(mesh, options).mesh), area, 1e-10) << name;
      }
    }
  }
}

TEST(Slide, FoldsNoFacetWithoutTheGuard) {
  for (const auto& [name, region] : shapes(4)) {
    const Cells cells(ElementType::tetrahedron, 4, region);
    const double area = boundary_area(cells.mesh());
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Mesh mesh = valid_mesh(cells, seed, 0.5);
      for (const Form form : {Form::jacobi, Form::gauss_seidel, Form::asynchronous}) {
        SmoothOptions options =
            sliding(Laplacian{.weighting = Weighting::edge_length, .relaxation = 1}, form);
        options.guard = false;
        options.max_iterations = 10;
        EXPECT_NEAR(boundary_area(test::smooth(mesh, options).mesh), area, 1e-10) << name;
      }
    }
  }
}

/// A block curved by an angle along the plane x = 2.
Mesh curved(ElementType type, double degrees) {
  const double slope = std::tan(degrees * std::numbers::pi / 180);
  return test::mapped(test::lattice(type, 4), [=](Vec3d p) {
    const double rise = slope * std::max(0.0, p.x - 2);
    return test::oracle::is_surface(type) ? Vec3d{p.x, p.y + rise, p.z}
                                          : Vec3d{p.x, p.y, p.z + rise};
  });
}

TEST(Slide, TakesPlanesThatMeetAtLessThanTheFeatureAngleForCurved) {
  struct Case {
    double degrees, angle;
    int on_surface, on_curve, on_line;
  };
  for (const Case& expected :
       std::vector<Case>{{20, 30, 6, 4, 32}, {20, 15, 0, 0, 32 + 6}, {0, 30, 0, 0, 36}}) {
    SmoothOptions options = sliding();
    options.feature_angle = expected.angle;
    const NodeCounts counts =
        test::smooth(curved(ElementType::hexahedron, expected.degrees), options).summary.nodes;
    SCOPED_TRACE(std::to_string(expected.degrees) + " " + std::to_string(expected.angle));
    EXPECT_EQ(counts.sliding_on_surface, expected.on_surface);
    EXPECT_EQ(counts.sliding_on_curve, expected.on_curve);
    EXPECT_EQ(counts.sliding_on_line, expected.on_line);
    EXPECT_EQ(counts.sliding_in_plane, 6 * 9 - (expected.degrees == 0 ? 0 : 6));
    EXPECT_EQ(counts.curved, 0);
  }
  // The edges of a surface go on along a curve, or end at a corner.
  for (const double angle : {15.0, 30.0}) {
    SmoothOptions options = sliding();
    options.feature_angle = angle;
    const NodeCounts counts = test::smooth(curved(ElementType::quad, 20), options).summary.nodes;
    EXPECT_EQ(counts.sliding_on_curve, angle > 20 ? 2 : 0);
    EXPECT_EQ(counts.sliding_on_line, 4 * 3 - 2);
    EXPECT_EQ(counts.curved, 0);
  }
}

TEST(Slide, LeavesTheFrontOfASlitWhereItIsAndItsLipsMatched) {
  Mesh mesh = test::lattice(ElementType::hexahedron, 4);
  const std::size_t whole = mesh.node_count();
  std::vector<NodeId> upper(whole, -1);  // the second node of one on the slit x < 2, y = 2
  std::vector<std::size_t> front;
  for (std::size_t n = 0; n < whole; ++n) {
    const Vec3d p = points(mesh)[n];
    if (p.y != 2 || p.x > 2) continue;
    if (p.x == 2) {
      front.push_back(n);
      continue;
    }
    upper[n] = static_cast<NodeId>(mesh.node_count());
    points(mesh).push_back(p);
  }
  const std::vector<Vec3d>& x = points(mesh);
  for (std::size_t e = 0; e < mesh.blocks[0].nodes.size(); e += 8) {
    NodeId* const nodes = &mesh.blocks[0].nodes[e];
    if (x[nodes[6]].y < 2.5) continue;
    for (int k = 0; k < 8; ++k) {
      if (static_cast<std::size_t>(nodes[k]) < whole && upper[nodes[k]] >= 0) {
        nodes[k] = upper[nodes[k]];
      }
    }
  }
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    const bool inner = points(mesh)[n].x == 1 && points(mesh)[n].z > 0 && points(mesh)[n].z < 4;
    if (inner) points(mesh)[n].x += 0.3;
  }

  const Job job = test::smooth(mesh, sliding());

  ASSERT_EQ(front.size(), 5U);
  for (const std::size_t n : front) EXPECT_EQ(points(job.mesh)[n], points(mesh)[n]);
  // Its lips share their positions, so they stay matched.
  EXPECT_EQ(job.summary.nodes.coincident, 20);
  for (std::size_t n = 0; n < whole; ++n) {
    if (upper[n] < 0) continue;
    EXPECT_EQ(points(job.mesh)[upper[n]], points(job.mesh)[n]);
  }
}

TEST(Regions, AreKeptLikeTheBoundary) {
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, region] : shapes(4)) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
      const Cells cells(type, 4, region);
      const Mesh mesh = valid_mesh(cells, 8);
      const int inner = test::oracle::is_surface(type) ? 2 : 3;
      const std::vector<bool> used = cells.used();
      std::int64_t between = 0;
      const std::set<NodeId> boundary = test::oracle::boundary_nodes(mesh);
      for (std::size_t n = 0; n < used.size(); ++n) {
        const bool kept = used[n] && cells.node_constraints(n) < inner;
        between += kept && boundary.count(static_cast<NodeId>(n)) == 0 ? 1 : 0;
      }
      for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}, Optimize{}}) {
        SmoothOptions options = sliding(method);
        options.boundary = BoundaryPolicy::fixed;

        const Job job = test::smooth(mesh, options);

        for (int node_constraints = 0; node_constraints < inner; ++node_constraints) {
          EXPECT_EQ(moved(cells, node_constraints, mesh, job.mesh), 0);
        }
        EXPECT_GT(moved(cells, inner, mesh, job.mesh), 0);
        const NodeCounts& counts = job.summary.nodes;
        EXPECT_EQ(counts.fixed, counts.boundary + between);
        EXPECT_GE(counts.between_regions, between);
        EXPECT_EQ(counts.sliding_in_plane + counts.sliding_on_line, 0);

        options.boundary = BoundaryPolicy::free;
        EXPECT_EQ(test::smooth(mesh, options).summary.nodes.fixed, 0);
      }
    }
  }
}

}  // namespace
}  // namespace meshsmooth
