// Shape metrics against VTK's Verdict.

#include <gtest/gtest.h>
#include <vtkMeshQuality.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "formats/verdict.hpp"
#include "meshsmooth/shape_metrics.hpp"

// No class of VTK 9.1 offers these; later ones export them under other names.
#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
extern "C" {
double vtkverdict__wedge_edge_ratio(int node_count, VerdictNodes nodes);
double vtkverdict__wedge_condition(int node_count, VerdictNodes nodes);
double vtkverdict__wedge_jacobian(int node_count, VerdictNodes nodes);
}
#else
namespace vtkverdict {
double wedge_edge_ratio(int node_count, VerdictNodes nodes);
double wedge_condition(int node_count, VerdictNodes nodes);
double wedge_jacobian(int node_count, VerdictNodes nodes);
}  // namespace vtkverdict
#endif

namespace meshsmooth {
namespace {

using namespace test;

#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
constexpr auto kWedgeEdgeRatio = vtkverdict__wedge_edge_ratio;
constexpr auto kWedgeCondition = vtkverdict__wedge_condition;
constexpr auto kWedgeJacobian = vtkverdict__wedge_jacobian;
#else
constexpr auto kWedgeEdgeRatio = vtkverdict::wedge_edge_ratio;
constexpr auto kWedgeCondition = vtkverdict::wedge_condition;
constexpr auto kWedgeJacobian = vtkverdict::wedge_jacobian;
#endif

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// 1,000 elements of a type: mostly valid, distorted, strongly distorted.
std::vector<Nodes> random_elements(ElementType type) {
  std::vector<Nodes> all;
  for (const double size : {0.1, 0.3, 0.5, 0.8}) {
    RandomElements elements(type, size);
    for (int count = 0; count < 250; ++count) all.push_back(elements.next());
  }
  return all;
}

/// Verdict has 1e30, or that over 2 or 3, for infinity.
double finite_or_infinite(double verdict) { return verdict > 1e29 ? kInfinity : verdict; }

/// Asks for `expected(nodes)` of every random element, to `tolerance` relative.
template <class Expected>
void expect_verdict(ElementType type, ShapeMetric metric, double tolerance, Expected expected) {
  std::set<double> finite;
  for (const Nodes& nodes : random_elements(type)) {
    const double ours = measure_shape(type, nodes.data(), metric);
    const double theirs = finite_or_infinite(expected(nodes));
    if (std::isinf(theirs)) {
      ASSERT_EQ(ours, theirs);
      continue;
    }
    ASSERT_NEAR(ours, theirs, tolerance * std::max(1.0, std::abs(theirs))) << element_name(type);
    finite.insert(ours);
  }
  EXPECT_GT(finite.size(), 300U) << "most elements have the metric, each its own value";
}

auto by_vtk(double (*metric)(vtkCell*), int cell_type) {
  return [=](const Nodes& nodes) { return verdict(metric, cell_type, nodes); };
}

TEST(VerdictShape, AspectRatio) {
  constexpr auto kMetric = ShapeMetric::aspect_ratio;
  expect_verdict(ElementType::triangle, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::TriangleAspectRatio, VTK_TRIANGLE));
  expect_verdict(ElementType::quad, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::QuadAspectRatio, VTK_QUAD));
  expect_verdict(ElementType::tetrahedron, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::TetAspectRatio, VTK_TETRA));
}

TEST(VerdictShape, EdgeRatio) {
  constexpr auto kMetric = ShapeMetric::edge_ratio;
  expect_verdict(ElementType::triangle, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::TriangleEdgeRatio, VTK_TRIANGLE));
  expect_verdict(ElementType::quad, kMetric, 1e-9, by_vtk(vtkMeshQuality::QuadEdgeRatio, VTK_QUAD));
  expect_verdict(ElementType::tetrahedron, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::TetEdgeRatio, VTK_TETRA));
  expect_verdict(ElementType::wedge, kMetric, 1e-9,
                 [](const Nodes& nodes) { return verdict(kWedgeEdgeRatio, kWedgeOrder, nodes); });
}

template <std::size_t count>
Nodes in_order(const Nodes& nodes, const std::array<std::size_t, count>& order) {
  Nodes result;
  for (const std::size_t node : order) result.push_back(nodes[node]);
  return result;
}

// The manual takes all edges; Verdict (of VTK 9.1 to 9.3) looks for the longest among the first six
// of twelve only. In these four node orders each edge is among them.
TEST(VerdictShape, EdgeRatioOfHexahedra) {
  constexpr std::array<std::array<std::size_t, 8>, 4> kOrders = {{{0, 1, 2, 3, 4, 5, 6, 7},
                                                                  {4, 7, 6, 5, 0, 3, 2, 1},
                                                                  {0, 4, 5, 1, 3, 7, 6, 2},
                                                                  {2, 3, 7, 6, 1, 0, 4, 5}}};
  expect_verdict(ElementType::hexahedron, ShapeMetric::edge_ratio, 1e-9, [&](const Nodes& nodes) {
    double largest = 0;
    for (const auto& order : kOrders) {
      largest = std::max(
          largest, verdict(vtkMeshQuality::HexEdgeRatio, VTK_HEXAHEDRON, in_order(nodes, order)));
    }
    return largest;
  });
}

TEST(VerdictShape, ConditionNumber) {
  constexpr auto kMetric = ShapeMetric::condition_number;
  expect_verdict(ElementType::triangle, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::TriangleCondition, VTK_TRIANGLE));
  expect_verdict(ElementType::quad, kMetric, 1e-9, by_vtk(vtkMeshQuality::QuadCondition, VTK_QUAD));
  expect_verdict(ElementType::hexahedron, kMetric, 1e-9,
                 by_vtk(vtkMeshQuality::HexCondition, VTK_HEXAHEDRON));
  // The manual has DBL_MAX for inverted tetrahedra, Verdict a negative number.
  expect_verdict(ElementType::tetrahedron, kMetric, 1e-9, [](const Nodes& nodes) {
    const double condition = verdict(vtkMeshQuality::TetCondition, VTK_TETRA, nodes);
    return condition < 0 ? kInfinity : condition;
  });
}

// Verdict divides by 1.16477 where the ideal corner has 4 / (3 cbrt(1.5)) = 1.164774. The manual
// takes all six corners; Verdict 9.1 omits the fifth, so that it is asked in two node orders. Later
// versions do not, and give no less than 1. Verdict takes no sign; ours is infinite where a corner
// is inverted, as the condition numbers of all other types are.
TEST(VerdictShape, ConditionNumberOfWedges) {
  constexpr std::array<std::size_t, 6> kTurned = {2, 1, 0, 5, 4, 3};
  const double exact = 4 / (3 * std::cbrt(1.5));
  ASSERT_NEAR(exact, 1.16477, 4e-6);
  expect_verdict(ElementType::wedge, ShapeMetric::condition_number, 1e-9, [&](const Nodes& nodes) {
    if (verdict(kWedgeJacobian, kWedgeOrder, nodes) <= 0) return kInfinity;
    const double condition = std::max(verdict(kWedgeCondition, kWedgeOrder, nodes),
                                      verdict(kWedgeCondition, kTurned, nodes));
    return std::max(condition * (1.16477 / exact), 1.0);
  });
}

/// The faces of an element, each as nodes of its own.
std::vector<Nodes> faces_of(ElementType type, const Nodes& nodes) {
  const ElementShape& shape = element_shape(type);
  if (shape.dimension == 2) return {nodes};
  std::vector<Nodes> faces;
  for (int f = 0; f < shape.facet_count; ++f) {
    Nodes& face = faces.emplace_back();
    for (int n = 0; n < shape.facets[f].node_count; ++n) {
      face.push_back(nodes[static_cast<std::size_t>(shape.facets[f].nodes[n])]);
    }
  }
  return faces;
}

double skew(double least, double largest, double ideal) {
  return std::max((largest - ideal) / (180 - ideal), (ideal - least) / ideal);
}

/// Of the dihedral angles: at each edge the angle between the two other nodes, seen along it.
double dihedral_skew(const Nodes& p) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  constexpr std::size_t kEdges[6][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2},
                                        {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};
  double least = 180, largest = 0;
  for (const auto& nodes : kEdges) {
    const Vec3d origin = p[nodes[0]];
    const Vec3d edge = p[nodes[1]] - origin;
    const auto across = [&](Vec3d node) {
      const Vec3d way = node - origin;
      return way - (dot(way, edge) / dot(edge, edge)) * edge;
    };
    const Vec3d a = across(p[nodes[2]]), b = across(p[nodes[3]]);
    const double angle = std::acos(dot(a, b) / (norm(a) * norm(b))) * kDegrees;
    least = std::min(least, angle);
    largest = std::max(largest, angle);
  }
  return skew(least, largest, std::acos(1.0 / 3) * kDegrees);
}

// The Verdict of VTK 9.1 has the angles of triangles and quads, but not the skew made of them. Its
// angles are arc cosines, which lose half the digits near 0 and 180 degrees.
TEST(VerdictShape, EquiangleSkewByTheAnglesOfTheFaces) {
  for (const ElementType type : kLinearTypes) {
    expect_verdict(type, ShapeMetric::equiangle_skew, 1e-7, [&](const Nodes& nodes) {
      double worst = type == ElementType::tetrahedron ? dihedral_skew(nodes) : 0;
      for (const Nodes& face : faces_of(type, nodes)) {
        if (face.size() == 3) {
          worst = std::max(worst,
                           skew(verdict(vtkMeshQuality::TriangleMinAngle, VTK_TRIANGLE, face),
                                verdict(vtkMeshQuality::TriangleMaxAngle, VTK_TRIANGLE, face), 60));
        } else {
          worst = std::max(worst, skew(verdict(vtkMeshQuality::QuadMinAngle, VTK_QUAD, face),
                                       verdict(vtkMeshQuality::QuadMaxAngle, VTK_QUAD, face), 90));
        }
      }
      return worst;
    });
  }
}

#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 2, 0)
TEST(VerdictShape, EquiangleSkew) {
  constexpr auto kMetric = ShapeMetric::equiangle_skew;
  expect_verdict(ElementType::triangle, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::TriangleEquiangleSkew, VTK_TRIANGLE));
  expect_verdict(ElementType::quad, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::QuadEquiangleSkew, VTK_QUAD));
  expect_verdict(ElementType::tetrahedron, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::TetEquiangleSkew, VTK_TETRA));
  expect_verdict(ElementType::pyramid, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::PyramidEquiangleSkew, VTK_PYRAMID));
  expect_verdict(ElementType::wedge, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::WedgeEquiangleSkew, VTK_WEDGE));
  expect_verdict(ElementType::hexahedron, kMetric, 1e-7,
                 by_vtk(vtkMeshQuality::HexEquiangleSkew, VTK_HEXAHEDRON));
}
#endif

}  // namespace
}  // namespace meshsmooth
