// Our quality measures against VTK's Verdict.

#include <gtest/gtest.h>
#include <vtkMeshQuality.h>

#include <array>
#include <cmath>
#include <numbers>

#include "formats/verdict.hpp"
#include "meshsmooth/quality.hpp"

// In VTK 9.1 no class offers these; later ones export them under other names.
#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
extern "C" {
double vtkverdict__v_pyramid_volume(int node_count, VerdictNodes nodes);
double vtkverdict__v_wedge_volume(int node_count, VerdictNodes nodes);
double vtkverdict__wedge_scaled_jacobian(int node_count, VerdictNodes nodes);
}
#else
namespace vtkverdict {
double pyramid_volume(int node_count, VerdictNodes nodes);
double wedge_volume(int node_count, VerdictNodes nodes);
double wedge_scaled_jacobian(int node_count, VerdictNodes nodes);
}  // namespace vtkverdict
#endif

namespace meshsmooth {
namespace {

using namespace test;

#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
constexpr auto kPyramidVolume = vtkverdict__v_pyramid_volume;
constexpr auto kWedgeVolume = vtkverdict__v_wedge_volume;
constexpr auto kWedgeScaledJacobian = vtkverdict__wedge_scaled_jacobian;
#else
constexpr auto kPyramidVolume = vtkverdict::pyramid_volume;
constexpr auto kWedgeVolume = vtkverdict::wedge_volume;
constexpr auto kWedgeScaledJacobian = vtkverdict::wedge_scaled_jacobian;
#endif

constexpr int kElementsPerTest = 2000;
constexpr double kTolerance = 1e-10;

ElementMeasure measure(ElementType type, const Nodes& nodes) {
  return measure_element(type, nodes.data(), {0, 0, 1});
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
