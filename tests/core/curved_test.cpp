// Nodes that slide on curved parts of the boundary and between regions. How far off they are
// is measured by looking at every facet.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "support/cells.hpp"
#include "support/input_surface.hpp"

namespace meshsmooth {
namespace {

using test::Cells;
using test::InputSurface;
using test::Job;
using test::mean_ratio;
using test::points;
using test::same_bits;
using test::oracle::Point;

bool is_valid(const Mesh& mesh) {
  const QualityStats quality = measure_quality(mesh);
  return quality.inverted_count == 0 && quality.degenerate_count == 0;
}

SmoothOptions sliding(const Method& method = Optimize{}, Form form = Form::automatic) {
  return {.method = method,
          .form = form,
          .max_iterations = 25,
          .boundary = BoundaryPolicy::slide,
          .feature_angle = 45,
          .never_worse = false};
}

using Bend = Vec3d (*)(Vec3d unit);

/// Part of a pipe: two curved sides, one inwards; curved creases.
Vec3d pipe(Vec3d p) {
  const double angle = 1.3 * p.x, radius = 1 + p.y;
  return {radius * std::sin(angle), radius * std::cos(angle), p.z};
}
/// Part of a shell between two spheres; its sides are planes and cones.
Vec3d shell(Vec3d p) {
  const double a = 1.2 * (p.x - 0.5), b = 1.2 * (p.y - 0.5), radius = 1 + p.z;
  return {radius * std::sin(a) * std::cos(b), radius * std::sin(b),
          radius * std::cos(a) * std::cos(b)};
}
/// A plate that is curved up and down.
Vec3d wave(Vec3d p) { return {p.x, p.y, p.z + 0.06 * std::sin(6 * p.x) * std::cos(5 * p.y)}; }

const std::vector<std::pair<std::string, Bend>> kBends = {
    {"pipe", pipe}, {"shell", shell}, {"wave", wave}};

constexpr int kCells = 5;

/// The cells thrown about as far as leaves them valid, then curved.
Mesh curved(const Cells& cells, Bend bend, unsigned seed, double size = 0.25, int n = kCells) {
  for (;; size *= 0.8) {
    Mesh mesh =
        test::mapped(cells.thrown(size, seed), [&](Vec3d p) { return bend((1.0 / n) * p); });
    if (is_valid(mesh)) return mesh;
  }
}

/// The pieces of the creases: between nodes that may move along the same axis only, or not
/// at all.
std::vector<std::array<Point, 2>> crease_segments(const Cells& cells, const Mesh& mesh) {
  const test::oracle::Points x = test::oracle::to_points(mesh);
  std::set<std::pair<NodeId, NodeId>> edges;
  for (const std::vector<NodeId>& nodes : test::constrained_facets(mesh)) {
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      edges.insert(std::minmax(nodes[k], nodes[(k + 1) % nodes.size()]));
    }
  }
  const auto on_crease = [&](NodeId node, int axis) {
    for (int other = 0; other < 3; ++other) {
      if (other != axis && cells.may_move(static_cast<std::size_t>(node), other)) return false;
    }
    return true;
  };
  std::vector<std::array<Point, 2>> result;
  for (const auto& [a, b] : edges) {
    const Vec3d way =
        cells.grid(static_cast<std::size_t>(b)) - cells.grid(static_cast<std::size_t>(a));
    const int axes = (way.x != 0) + (way.y != 0) + (way.z != 0);
    const int axis = way.x != 0 ? 0 : way.y != 0 ? 1 : 2;
    if (axes == 1 && on_crease(a, axis) && on_crease(b, axis)) result.push_back({x[a], x[b]});
  }
  return result;
}

/// How far the nodes are from the corners, creases and facets that they may not leave.
double off_input(const Cells& cells, const Mesh& before, const Mesh& after) {
  const bool surface = test::oracle::is_surface(before.blocks[0].type);
  const std::vector<std::array<Point, 2>> segments = crease_segments(cells, before);
  const std::optional<InputSurface> facets =
      surface ? std::nullopt : std::optional<InputSurface>(before);
  const test::oracle::Points x = test::oracle::to_points(before);
  const test::oracle::Points y = test::oracle::to_points(after);
  const std::vector<bool> used = cells.used();
  double farthest = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    if (!used[n]) continue;
    double off = 0;
    const int node_constraints = cells.node_constraints(n);
    if (node_constraints == 0) off = (y[n] - x[n]).norm();
    if (node_constraints == 1) {
      off = std::numeric_limits<double>::infinity();
      for (const auto& [a, b] : segments) {
        off = std::min(off, test::distance_to_segment(a, b, y[n]));
      }
    }
    if (node_constraints == 2 && !surface) off = facets->distance(y[n]);
    farthest = std::max(farthest, off);
  }
  return farthest;
}

class CurvedWay : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Curved, CurvedWay, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(CurvedWay, KeepsTheInputsFacetsCreasesAndCorners) {
  for (const ElementType type : kLinearTypes) {
    const auto shapes = test::shapes(kCells);
    for (std::size_t b = 0; b < kBends.size(); ++b) {
      for (std::size_t s = b; s < shapes.size(); s += kBends.size()) {
        SCOPED_TRACE(kBends[b].first + " " + shapes[s].first + " of " +
                     std::string(element_name(type)));
        const Cells cells(type, kCells, shapes[s].second);
        const Mesh mesh = curved(cells, kBends[b].second, 1);

        const Job job = test::smooth(mesh, sliding(GetParam().method, GetParam().form));

        const BoundaryDeviation& told = job.summary.deviation;
        EXPECT_LE(off_input(cells, mesh, job.mesh), told.tolerance);
        EXPECT_LE(told.result_to_input, told.tolerance);
        EXPECT_LT(told.tolerance, 1e-14 * 300);
        EXPECT_TRUE(is_valid(job.mesh));
        EXPECT_GT(moved(cells, 1, mesh, job.mesh), 0);
        if (!test::oracle::is_surface(type)) {
          EXPECT_GT(moved(cells, 2, mesh, job.mesh), 0);
        }
        EXPECT_NEAR(job.summary.quality_after.enclosed_volume,
                    job.summary.quality_before.enclosed_volume,
                    0.05 * job.summary.quality_before.enclosed_volume);
      }
    }
  }
}

TEST(Curved, CountsWhatItFinds) {
  for (const ElementType type : kLinearTypes) {
    for (const auto& [bend_name, bend] : kBends) {
      for (const auto& [name, region] : test::shapes(kCells)) {
        SCOPED_TRACE(bend_name + " " + name + " of " + std::string(element_name(type)));
        if (bend == wave && test::oracle::is_surface(type)) continue;  // four straight edges
        const Cells cells(type, kCells, region);
        const std::vector<bool> used = cells.used();
        std::int64_t by_constraints[4] = {0, 0, 0, 0};
        for (std::size_t n = 0; n < used.size(); ++n) {
          by_constraints[cells.node_constraints(n)] += used[n] ? 1 : 0;
        }

        const NodeCounts counts = test::smooth(curved(cells, bend, 3), sliding()).summary.nodes;

        EXPECT_EQ(counts.fixed, by_constraints[0]);
        EXPECT_EQ(counts.sliding_on_line + counts.sliding_on_curve, by_constraints[1]);
        if (!test::oracle::is_surface(type)) {
          EXPECT_EQ(counts.sliding_in_plane + counts.sliding_on_surface, by_constraints[2]);
          EXPECT_GT(counts.sliding_on_surface, 0);
        }
        EXPECT_GT(counts.sliding_on_curve, 0);
        EXPECT_EQ(counts.curved, 0);
      }
    }
  }
}

TEST(Curved, SaysHowFarBoundaryAndInputAreApart) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    const Cells cells(type, kCells, test::shapes(kCells)[0].second);
    const Mesh mesh = curved(cells, shell, 4);
    const Job job = test::smooth(mesh, sliding());

    const InputSurface now(job.mesh);
    const test::oracle::Points x = test::oracle::to_points(mesh);
    double farthest = 0;
    for (std::size_t n = 0; n < x.size(); ++n) {
      if (cells.node_constraints(n) < 3) farthest = std::max(farthest, now.distance(x[n]));
    }
    EXPECT_GT(farthest, 1e-4);
    EXPECT_NEAR(job.summary.deviation.input_to_result, farthest, 0.3 * farthest);
    EXPECT_GE(job.summary.deviation.input_to_result, farthest * (1 - 1e-12));
  }
}

TEST(Curved, SaysNothingWhereAllIsPlane) {
  const Job job = test::smooth(test::lattice(ElementType::tetrahedron, 3), sliding());
  EXPECT_EQ(job.summary.deviation.tolerance, 0);
  EXPECT_EQ(job.summary.deviation.input_to_result, 0);
}

TEST(Curved, KeepsItsPromisesInFloat32) {
  for (const ElementType type : kLinearTypes) {
    const Cells cells(type, kCells, test::shapes(kCells)[4].second);
    const Mesh mesh = test::as_float32(curved(cells, pipe, 5));
    ASSERT_TRUE(is_valid(mesh));
    for (const Method& method : std::vector<Method>{Optimize{}, SmartLaplacian{}, Laplacian{}}) {
      const Job job = test::smooth(mesh, sliding(method));

      EXPECT_LE(off_input(cells, mesh, job.mesh), job.summary.deviation.tolerance);
      EXPECT_GT(job.summary.deviation.result_to_input, 0);
      EXPECT_LT(job.summary.deviation.tolerance, 2e-6);
      EXPECT_TRUE(is_valid(job.mesh));
    }
  }
}

TEST(Curved, GivesTheSameBitsOnAnyNumberOfThreads) {
  const int n = 14;
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    const Cells cells(type, n, test::shapes(n)[4].second);
    const Mesh mesh = curved(cells, shell, 6, 0.25, n);
    for (const Method& method : std::vector<Method>{Optimize{}, SmartLaplacian{}, Laplacian{}}) {
      const Mesh one = test::smooth(mesh, sliding(method), 1).mesh;
      EXPECT_TRUE(same_bits(one, test::smooth(mesh, sliding(method), 2).mesh));
      EXPECT_TRUE(same_bits(one, test::smooth(mesh, sliding(method), 5).mesh));
    }
  }
}

TEST(Curved, KeepsTheCallersNodesAndTheMovementLimit) {
  for (const Form form : {Form::gauss_seidel, Form::jacobi}) {
    const Cells cells(ElementType::tetrahedron, kCells, test::shapes(kCells)[0].second);
    Mesh mesh = curved(cells, shell, 7);
    for (std::size_t n = 0; n < mesh.node_count(); ++n) mesh.fixed.push_back(n % 3 == 0 ? 1 : 0);
    SmoothOptions options = sliding(SmartLaplacian{}, form);
    options.movement_limit = MovementLimit{.value = 0.01};

    const Job job = test::smooth(mesh, options);

    double farthest = 0;
    for (std::size_t n = 0; n < mesh.node_count(); ++n) {
      const double way = norm(points(job.mesh)[n] - points(mesh)[n]);
      if (cells.node_constraints(n) < 3) farthest = std::max(farthest, way);
      EXPECT_LE(way, 0.01 * (1 + 1e-12));
      if (mesh.fixed[n] != 0) {
        EXPECT_EQ(way, 0);
      }
    }
    EXPECT_GT(farthest, 0.0098);
    EXPECT_LE(off_input(cells, mesh, job.mesh), job.summary.deviation.tolerance);
  }
}

TEST(Curved, MakesABetterMeshThanAFixedBoundaryAndNeverMoreEnergy) {
  for (const ElementType type : kLinearTypes) {
    for (const auto& [name, bend] : kBends) {
      SCOPED_TRACE(name + " of " + std::string(element_name(type)));
      const Cells cells(type, kCells, test::shapes(kCells)[0].second);
      const Mesh mesh = curved(cells, bend, 8);
      SmoothOptions options = sliding();
      options.history = true;
      const Job slid = test::smooth(mesh, options);
      options.boundary = BoundaryPolicy::fixed;
      const Job held = test::smooth(mesh, options);

      EXPECT_GT(mean_ratio(slid.summary.quality_after).mean,
                mean_ratio(held.summary.quality_after).mean + 0.003);
      const std::vector<double>& energies = slid.summary.convergence.energies;
      ASSERT_GT(energies.size(), 2U);
      for (std::size_t k = 1; k < energies.size(); ++k) {
        EXPECT_LE(energies[k], energies[k - 1] * (1 + 1e-13));
      }
    }
  }
}

TEST(Curved, UntanglesInsideACurvedBoundary) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    for (const auto& [name, bend] : kBends) {
      const Cells cells(type, kCells, test::shapes(kCells)[0].second);
      Mesh mesh = curved(cells, bend, 9);
      const Mesh thrown =
          test::mapped(cells.thrown(1.0, 9), [&](Vec3d p) { return bend((1.0 / kCells) * p); });
      for (std::size_t n = 0; n < mesh.node_count(); ++n) {
        if (cells.node_constraints(n) == 3) points(mesh)[n] = points(thrown)[n];
      }
      ASSERT_GT(measure_quality(mesh).inverted_count, 0);
      SmoothOptions options = sliding();
      options.max_iterations = 300;

      const Job job = test::smooth(mesh, options);

      EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << name;
      EXPECT_LE(off_input(cells, mesh, job.mesh), job.summary.deviation.tolerance) << name;
    }
  }
}

TEST(Curved, LetsEveryNodeOfASphereSlide) {
  Mesh mesh = test::spokes(3);
  points(mesh).back() = {0.2, 0.1, -0.1};

  const Job job = test::smooth(mesh, sliding());

  EXPECT_EQ(job.summary.nodes.sliding_on_surface, job.summary.nodes.boundary);
  EXPECT_EQ(job.summary.nodes.fixed, 0);
  const InputSurface sphere(mesh);
  for (const Point& p : test::oracle::to_points(job.mesh)) {
    if (p.norm() > 0.5) {
      EXPECT_LE(sphere.distance(p), job.summary.deviation.tolerance);
    }
  }
}

/// At the corners of an octahedron facets that share an edge turn by 71 degrees, those
/// that do not by 109.
TEST(Curved, LeavesANodeWhoseFacetsTurnTooFarWhereItIs) {
  SmoothOptions options = sliding();
  options.feature_angle = 80;

  const Job job = test::smooth(test::tet_ball(), options);

  EXPECT_EQ(job.summary.nodes.curved, 6);
  EXPECT_EQ(job.summary.nodes.fixed, 6);
  EXPECT_EQ(job.summary.nodes.moved, 1);
}

}  // namespace
}  // namespace meshsmooth
