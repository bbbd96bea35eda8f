// The certificates of elements of second order against VTK's shape functions, of 3,000 elements of
// each type or as many as MESHSMOOTH_CERTIFICATE_COUNT says.

#include <gtest/gtest.h>
#include <vtkBiQuadraticQuad.h>
#include <vtkBiQuadraticQuadraticWedge.h>
#include <vtkNew.h>
#include <vtkQuadraticHexahedron.h>
#include <vtkQuadraticPyramid.h>
#include <vtkQuadraticQuad.h>
#include <vtkQuadraticTetra.h>
#include <vtkQuadraticTriangle.h>
#include <vtkQuadraticWedge.h>
#include <vtkTriQuadraticHexahedron.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>

#include "mesh/curved_jacobian.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using detail::JacobianSign;

/// VTK's derivatives of the shape functions at a point, by axis and node.
std::vector<double> derivatives(ElementType type, const std::array<double, 3>& at) {
  std::vector<double> found(3 * element_width(type));
  const auto by = [&](auto cell) { cell->InterpolateDerivs(at.data(), found.data()); };
  switch (type) {
    case ElementType::triangle6:
      by(vtkNew<vtkQuadraticTriangle>());
      break;
    case ElementType::quad8:
      by(vtkNew<vtkQuadraticQuad>());
      break;
    case ElementType::quad9:
      by(vtkNew<vtkBiQuadraticQuad>());
      break;
    case ElementType::tetrahedron10:
      by(vtkNew<vtkQuadraticTetra>());
      break;
    case ElementType::pyramid13:
      by(vtkNew<vtkQuadraticPyramid>());
      break;
    case ElementType::wedge15:
      by(vtkNew<vtkQuadraticWedge>());
      break;
    case ElementType::wedge18:
      by(vtkNew<vtkBiQuadraticQuadraticWedge>());
      break;
    case ElementType::hexahedron20:
      by(vtkNew<vtkQuadraticHexahedron>());
      break;
    default:
      by(vtkNew<vtkTriQuadraticHexahedron>());
  }
  return found;
}

struct Sample {
  std::vector<double> derivatives;
  double scale;  // of the determinant
};

/// A lattice in the element. VTK's pyramid has a determinant that falls to 0 at the apex, and its
/// wedge a negative one.
std::vector<Sample> lattice_of(ElementType type, int count) {
  const ElementType linear = linear_type(type);
  const bool volume = element_shape(type).dimension == 3;
  std::vector<Sample> samples;
  for (int k = 0; k <= (volume ? count : 0); ++k) {
    for (int j = 0; j <= count; ++j) {
      for (int i = 0; i <= count; ++i) {
        const bool across = linear == ElementType::triangle || linear == ElementType::wedge;
        if (across && i + j > count) continue;
        if (linear == ElementType::tetrahedron && i + j + k > count) continue;
        const bool at_apex = linear == ElementType::pyramid && k == count;
        const double n = count, height = at_apex ? 0.9999 : k / n;
        const double apex = (1 - height) * (1 - height);
        samples.push_back(
            {derivatives(type, {i / n, j / n, height}), linear == ElementType::wedge     ? -1
                                                        : linear == ElementType::pyramid ? 1 / apex
                                                                                         : 1});
      }
    }
  }
  return samples;
}

/// The derivatives along the axes.
std::array<Vec3d, 3> columns_at(const Sample& sample, const std::vector<Vec3d>& nodes,
                                bool volume) {
  std::array<Vec3d, 3> columns{};
  for (std::size_t axis = 0; axis < (volume ? 3 : 2); ++axis) {
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      columns[axis] += sample.derivatives[axis * nodes.size() + n] * nodes[n];
    }
  }
  return columns;
}

double determinant_of(const std::array<Vec3d, 3>& columns, bool volume) {
  const Vec3d normal = cross(columns[0], columns[1]);
  return volume ? dot(normal, columns[2]) : normal.z;
}

double least_determinant(ElementType type, const std::vector<Sample>& samples,
                         const std::vector<Vec3d>& nodes) {
  const bool volume = element_shape(type).dimension == 3;
  double least = HUGE_VAL;
  for (const Sample& sample : samples) {
    least =
        std::min(least, sample.scale * determinant_of(columns_at(sample, nodes, volume), volume));
  }
  return least;
}

/// The longest product of the edges' derivatives at a corner of the linear element.
double longest_frame(ElementType linear, const std::array<Vec3d, 3>& t) {
  const double a = norm(t[0]), b = norm(t[1]), c = norm(t[2]);
  if (linear == ElementType::quad) return a * b;
  const double ab = norm(t[1] - t[0]), ac = norm(t[2] - t[0]), bc = norm(t[2] - t[1]);
  const double triangle = std::max({a * b, a * ab, b * ab});
  if (linear == ElementType::triangle) return triangle;
  if (linear == ElementType::wedge) return triangle * c;
  if (linear != ElementType::tetrahedron) return a * b * c;
  return std::max({a * b * c, a * ab * ac, b * ab * bc, c * ac * bc});
}

double least_scaled(ElementType type, const std::vector<Sample>& samples,
                    const std::vector<Vec3d>& nodes) {
  const bool volume = element_shape(type).dimension == 3;
  double least = HUGE_VAL;
  for (const Sample& sample : samples) {
    const std::array<Vec3d, 3> columns = columns_at(sample, nodes, volume);
    const double sign = sample.scale < 0 ? -1 : 1;
    least = std::min(
        least, sign * determinant_of(columns, volume) / longest_frame(linear_type(type), columns));
  }
  return least / element_shape(type).ideal.determinant;
}

class Certificate : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, Certificate, testing::ValuesIn(test::kSecondOrderTypes),
                         [](const auto& type) { return std::string(element_name(type.param)); });

/// An ideal element with its nodes moved at random.
std::vector<Vec3d> random_element(ElementType type, double amplitude, std::mt19937_64& random) {
  std::uniform_real_distribution<double> noise(-amplitude, amplitude);
  const bool volume = element_shape(type).dimension == 3;
  std::vector<Vec3d> nodes = test::ideal_points(linear_type(type));
  const auto moved = [&](Vec3d p, double by) {
    return p + by * Vec3d{noise(random), noise(random), volume ? noise(random) : 0};
  };
  for (Vec3d& node : nodes) node = moved(node, 0.5);
  for (const MidNode& mid : mid_nodes(type)) {
    Vec3d sum{0, 0, 0};
    for (int c = 0; c < mid.corner_count; ++c) {
      sum += nodes[static_cast<std::size_t>(mid.corners[static_cast<std::size_t>(c)])];
    }
    nodes.push_back(moved((1.0 / mid.corner_count) * sum, 1));
  }
  return nodes;
}

TEST_P(Certificate, SaysOfTheJacobianWhatVtkHasAtPoints) {
  const ElementType type = GetParam();
  const bool volume = element_shape(type).dimension == 3;
  const auto coarse = lattice_of(type, 8), fine = lattice_of(type, volume ? 24 : 64);
  std::mt19937_64 random(1);
  int positive = 0, negative = 0, unseen = 0;
  const char* const wanted = std::getenv("MESHSMOOTH_CERTIFICATE_COUNT");
  const int count = wanted == nullptr ? 3000 : std::stoi(wanted);
  for (int n = 0; n < count; ++n) {
    const auto nodes = random_element(type, 0.02 + 0.3 * n / count, random);
    const JacobianSign sign =
        detail::curved_jacobian_sign(type, nodes.data(), {0, 0, volume ? 0.0 : 1.0});
    double least = least_determinant(type, coarse, nodes);
    if (sign == JacobianSign::positive) {
      ++positive;
      EXPECT_GT(least, 0) << n;
    } else if (sign == JacobianSign::negative_somewhere) {
      ++negative;
      if (least >= 0) least = least_determinant(type, fine, nodes);
      if (least >= 0) ++unseen;  // between the points
      EXPECT_LT(least, 0.02) << n;
    }
  }
  EXPECT_GT(positive, count / 5);
  EXPECT_GT(negative, count / 10);
  EXPECT_LE(count - positive - negative, count / 1000);  // not certain
  EXPECT_LE(unseen, count / 100);
  RecordProperty("positive", positive);
  RecordProperty("negative", negative);
  RecordProperty("between_the_points", unseen);
}

TEST_P(Certificate, BoundsTheScaledJacobianFromBelow) {
  const ElementType type = GetParam();
  const bool volume = element_shape(type).dimension == 3;
  const auto lattice = lattice_of(type, volume ? 16 : 48);
  std::mt19937_64 random(2);
  double furthest = 0;
  for (int n = 0; n < 300; ++n) {
    const auto nodes = random_element(type, 0.1 * n / 300, random);
    const Vec3d normal{0, 0, volume ? 0.0 : 1.0};
    const double sampled = least_scaled(type, lattice, nodes);
    const double bound = detail::measure_nodes(type, nodes.data(), normal).scaled_jacobian;
    if (detail::curved_jacobian_sign(type, nodes.data(), normal) != JacobianSign::positive) {
      EXPECT_LE(bound, 0) << n;
      continue;
    }
    EXPECT_LE(bound, sampled + 1e-9) << n;
    EXPECT_GT(bound, 0) << n;
    furthest = std::max(furthest, sampled - bound);
  }
  EXPECT_LE(furthest, 0.006);  // with what lies between the points
  RecordProperty("furthest", std::to_string(furthest));
}

TEST_P(Certificate, OfAStraightElementIsThatOfItsCorners) {
  const ElementType type = GetParam();
  const Mesh mesh = test::second_order(test::single(linear_type(type)),
                                       type == test::second_order_type(linear_type(type), true));
  if (mesh.blocks[0].type != type) GTEST_SKIP() << "made with other nodes only";
  EXPECT_TRUE(detail::is_straight(type, test::points(mesh).data()));
  EXPECT_EQ(detail::curved_jacobian_sign(type, test::points(mesh).data(), {0, 0, 1}),
            JacobianSign::positive);
  EXPECT_NEAR(detail::least_scaled_jacobian(type, test::points(mesh).data(), {0, 0, 1}), 1, 3e-3);
}

}  // namespace
}  // namespace meshsmooth
