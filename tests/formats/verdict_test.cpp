// Our quality measures against VTK's Verdict.

#include <gtest/gtest.h>
#include <vtkCellType.h>
#include <vtkIdList.h>
#include <vtkMeshQuality.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>
#include <vtkVersion.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "meshsmooth/quality.hpp"
#include "support/meshes.hpp"

// In VTK 9.1 no class offers these; later ones export them under other names.
#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
using VerdictNodes = double (*)[3];
extern "C" {
double vtkverdict__v_pyramid_volume(int node_count, VerdictNodes nodes);
double vtkverdict__v_wedge_volume(int node_count, VerdictNodes nodes);
double vtkverdict__wedge_scaled_jacobian(int node_count, VerdictNodes nodes);
}
#else
using VerdictNodes = const double (*)[3];
namespace vtkverdict {
double pyramid_volume(int node_count, VerdictNodes nodes);
double wedge_volume(int node_count, VerdictNodes nodes);
double wedge_scaled_jacobian(int node_count, VerdictNodes nodes);
}  // namespace vtkverdict
#endif

namespace meshsmooth {
namespace {

#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
constexpr auto kPyramidVolume = vtkverdict__v_pyramid_volume;
constexpr auto kWedgeVolume = vtkverdict__v_wedge_volume;
constexpr auto kWedgeScaledJacobian = vtkverdict__wedge_scaled_jacobian;
#else
constexpr auto kPyramidVolume = vtkverdict::pyramid_volume;
constexpr auto kWedgeVolume = vtkverdict::wedge_volume;
constexpr auto kWedgeScaledJacobian = vtkverdict::wedge_scaled_jacobian;
#endif

using Nodes = std::vector<Vec3d>;

constexpr int kElementsPerTest = 2000;
constexpr double kTolerance = 1e-10;

/// Ideal elements with every node thrown about: most are valid, some very flat
/// or inverted. Surface elements stay plane.
class RandomElements {
 public:
  explicit RandomElements(ElementType type)
      : type_(type),
        is_surface_(element_shape(type).dimension == 2),
        noise_(is_surface_ ? -0.6 : -0.35, is_surface_ ? 0.6 : 0.35) {}
  Nodes next() {
    Nodes nodes = test::ideal_points(type_);
    for (Vec3d& node : nodes) {
      node += next_vector();
      if (is_surface_) node.z = 0;
      node = 3.7 * node;
    }
    return nodes;
  }
  /// The ideal element stretched and sheared: its quads stay plane.
  Nodes next_affine() {
    const Vec3d x = Vec3d{1, 0, 0} + next_vector();
    const Vec3d y = Vec3d{0, 1, 0} + next_vector();
    const Vec3d z = Vec3d{0, 0, 1} + next_vector();
    Nodes nodes = test::ideal_points(type_);
    for (Vec3d& node : nodes) node = node.x * x + node.y * y + node.z * z;
    return nodes;
  }

 private:
  Vec3d next_vector() {
    const double x = noise_(random_);
    const double y = noise_(random_);
    return {x, y, noise_(random_)};
  }

  ElementType type_;
  bool is_surface_;
  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> noise_;
};

ElementMeasure measure(ElementType type, const Nodes& nodes) {
  return measure_element(type, nodes.data(), {0, 0, 1});
}

/// One of vtkMeshQuality's functions on one cell.
double verdict(double (*metric)(vtkCell*), int cell_type, const Nodes& nodes) {
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const vtkNew<vtkIdList> cell;
  for (const Vec3d& node : nodes)
    cell->InsertNextId(points->InsertNextPoint(node.x, node.y, node.z));
  const vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points);
  grid->InsertNextCell(cell_type, cell);
  return metric(grid->GetCell(0));
}

/// A function of Verdict itself, nodes in the given order.
template <std::size_t count>
double verdict(double (*metric)(int, VerdictNodes), const std::array<std::size_t, count>& order,
               const Nodes& nodes) {
  std::array<double[3], count> places;
  for (std::size_t node = 0; node < count; ++node) {
    const Vec3d place = nodes[order[node]];
    places[node][0] = place.x;
    places[node][1] = place.y;
    places[node][2] = place.z;
  }
  return metric(static_cast<int>(count), places.data());
}

bool near(double a, double b) { return std::abs(a - b) <= kTolerance * std::max(1.0, std::abs(b)); }

double degrees(double cosine) { return std::acos(cosine) * 180 / std::numbers::pi; }

/// Asks `agree(nodes, measure)` of many elements; wants enough of them valid.
template <class Agree>
void compare(ElementType type, Agree agree) {
  RandomElements elements(type);
  int valid_count = 0;
  for (int count = 0; count < kElementsPerTest; ++count) {
    const Nodes nodes = elements.next();
    const ElementMeasure measured = measure(type, nodes);
    if (!measured.inverted && !measured.degenerate) ++valid_count;
    agree(nodes, measured);
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(valid_count, kElementsPerTest / 20);
  EXPECT_LT(valid_count, kElementsPerTest);
}

TEST(Verdict, AgreesOnTetrahedra) {
  compare(ElementType::tetrahedron, [](const Nodes& nodes, const ElementMeasure& m) {
    EXPECT_PRED2(near, m.volume, verdict(vtkMeshQuality::TetVolume, VTK_TETRA, nodes));
    EXPECT_PRED2(near, m.scaled_jacobian,
                 verdict(vtkMeshQuality::TetScaledJacobian, VTK_TETRA, nodes));
    // Verdict gives shape 0 to inverted elements and takes no sign in R / 3r.
    EXPECT_PRED2(near, std::max(m.mean_ratio, 0.0),
                 verdict(vtkMeshQuality::TetShape, VTK_TETRA, nodes));
    EXPECT_PRED2(near, std::abs(m.radius_ratio),
                 1 / verdict(vtkMeshQuality::TetRadiusRatio, VTK_TETRA, nodes));
  });
}

TEST(Verdict, AgreesOnTriangles) {
  compare(ElementType::triangle, [](const Nodes& nodes, const ElementMeasure& m) {
    // Verdict has no reference normal: all its triangles are valid.
    EXPECT_PRED2(near, std::abs(m.volume),
                 verdict(vtkMeshQuality::TriangleArea, VTK_TRIANGLE, nodes));
    EXPECT_PRED2(near, std::abs(m.mean_ratio),
                 verdict(vtkMeshQuality::TriangleShape, VTK_TRIANGLE, nodes));
    if (m.inverted) return;
    EXPECT_PRED2(near, m.scaled_jacobian,
                 verdict(vtkMeshQuality::TriangleScaledJacobian, VTK_TRIANGLE, nodes));
    EXPECT_NEAR(degrees(m.min_angle_cos),
                verdict(vtkMeshQuality::TriangleMinAngle, VTK_TRIANGLE, nodes), 1e-6);
    EXPECT_NEAR(degrees(m.max_angle_cos),
                verdict(vtkMeshQuality::TriangleMaxAngle, VTK_TRIANGLE, nodes), 1e-6);
  });
}

TEST(Verdict, AgreesOnQuads) {
  compare(ElementType::quad, [](const Nodes& nodes, const ElementMeasure& m) {
    if (m.inverted) return;  // Verdict takes the quad's own normal, not a reference
    EXPECT_PRED2(near, m.volume, verdict(vtkMeshQuality::QuadArea, VTK_QUAD, nodes));
    EXPECT_PRED2(near, m.mean_ratio, verdict(vtkMeshQuality::QuadShape, VTK_QUAD, nodes));
    EXPECT_PRED2(near, m.scaled_jacobian,
                 verdict(vtkMeshQuality::QuadScaledJacobian, VTK_QUAD, nodes));
  });
}

TEST(Verdict, AgreesOnHexahedra) {
  compare(ElementType::hexahedron, [](const Nodes& nodes, const ElementMeasure& m) {
    EXPECT_PRED2(near, std::max(m.mean_ratio, 0.0),
                 verdict(vtkMeshQuality::HexShape, VTK_HEXAHEDRON, nodes));
    EXPECT_PRED2(near, m.scaled_jacobian,
                 verdict(vtkMeshQuality::HexScaledJacobian, VTK_HEXAHEDRON, nodes));
  });
}

// Verdict's first triangle of a wedge looks inward.
constexpr std::array<std::size_t, 6> kWedgeOrder = {0, 2, 1, 3, 5, 4};
constexpr std::array<std::size_t, 5> kPyramidOrder = {0, 1, 2, 3, 4};

// Not compared: Verdict's wedge shape, a mean over the corners where ours is the
// worst one; Verdict 9.1 has no shape or scaled Jacobian of pyramids.
TEST(Verdict, AgreesOnTheScaledJacobianOfWedges) {
  compare(ElementType::wedge, [](const Nodes& nodes, const ElementMeasure& m) {
    EXPECT_PRED2(near, m.scaled_jacobian, verdict(kWedgeScaledJacobian, kWedgeOrder, nodes));
  });
}

// With plane quads: Verdict cuts warped ones along a diagonal, we take the
// bilinear surface.
TEST(Verdict, AgreesOnTheVolumeOfWedgesAndPyramids) {
  RandomElements wedges(ElementType::wedge);
  RandomElements pyramids(ElementType::pyramid);
  for (int count = 0; count < kElementsPerTest; ++count) {
    const Nodes wedge = wedges.next_affine();
    EXPECT_PRED2(near, measure(ElementType::wedge, wedge).volume,
                 verdict(kWedgeVolume, kWedgeOrder, wedge));
    const Nodes pyramid = pyramids.next_affine();
    EXPECT_PRED2(near, measure(ElementType::pyramid, pyramid).volume,
                 verdict(kPyramidVolume, kPyramidOrder, pyramid));
  }
}

}  // namespace
}  // namespace meshsmooth
