// Validity between the corners, against interval subdivision. How many random elements of each type
// and size: MESHSMOOTH_RANDOM_ELEMENTS, 3,000 by default.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "mesh/jacobian.hpp"
#include "support/jacobian_oracle.hpp"
#include "support/random_elements.hpp"

namespace meshsmooth {
namespace {

using test::random_element_count;

TEST(Jacobian, OfAHexahedronMayBeNegativeBetweenPositiveCorners) {
  const Vec3d corners[] = {{-0.1, -0.3, -0.2}, {1.6, 0.3, 0.4}, {0.6, 1.2, -0.1}, {-0.4, 0.8, 0},
                           {-0.4, 0, 1.2},     {0.6, 0.4, 1.2}, {1.1, 0.4, 0.6},  {-0.1, 1.5, 0.6}};
  const ElementMeasure measure = measure_element(ElementType::hexahedron, corners, {0, 0, 0});
  EXPECT_GT(measure.scaled_jacobian, 0);
  EXPECT_TRUE(measure.inverted);
  EXPECT_FALSE(measure.degenerate);
}

class CertifyElements : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, CertifyElements, testing::ValuesIn(test::kTypesWithAnInside),
                         [](const auto& type) { return std::string(element_name(type.param)); });

TEST_P(CertifyElements, AgreesWithIntervalSubdivision) {
  const ElementType type = GetParam();
  const Vec3d reference{0, 0, test::oracle::is_surface(type) ? 1.0 : 0.0};
  std::mt19937_64 random(17);
  int hidden = 0, undecided = 0, total = 0;
  for (const double size : test::kThrownSizes) {
    for (int n = 0; n < random_element_count(); ++n, ++total) {
      const std::vector<Vec3d> corners = test::thrown_corners(type, size, random);
      const ElementMeasure measure = measure_element(type, corners.data(), reference);
      undecided += measure.degenerate ? 1 : 0;
      const std::optional<bool> negative = test::oracle::is_negative_somewhere(type, corners);
      if (!negative) continue;
      if (*negative) {
        EXPECT_TRUE(measure.inverted || measure.degenerate) << size << " " << n;
        hidden += measure.inverted && measure.scaled_jacobian > 0 ? 1 : 0;
      } else {
        EXPECT_FALSE(measure.inverted) << size << " " << n;
      }
    }
  }
  EXPECT_LT(undecided, 1e-4 * total + 1);
  if (type == ElementType::hexahedron || type == ElementType::wedge) {
    EXPECT_GT(hidden, total / 2000);
  }
}

/// The conditions that spare most elements the coefficients are only ever sufficient.
TEST(Jacobian, IsPositiveWhereTheEdgesDominate) {
  std::mt19937_64 random(5);
  int dominant = 0;
  for (int n = 0; n < random_element_count(); ++n) {
    std::vector<Vec3d> corners = test::thrown_corners(ElementType::hexahedron, 0.45, random);
    for (Vec3d& p : corners) p = {p.x + 0.7 * p.y, 1e-4 * p.y, p.z};
    const detail::HexahedronEdges edges([&](int k) { return corners[k]; });
    if (!edges.dominant()) continue;
    ++dominant;
    EXPECT_EQ(edges.jacobian().sign(), detail::JacobianSign::positive) << n;
  }
  EXPECT_GT(dominant, random_element_count() / 20);
}

/// Half of it is the polynomial on that half.
TEST(Jacobian, IsHalvedAlongEveryAxis) {
  std::mt19937_64 random(3);
  const std::vector<Vec3d> corners = test::thrown_corners(ElementType::hexahedron, 0.5, random);
  const auto whole = detail::HexahedronEdges([&](int k) { return corners[k]; }).jacobian();
  const auto value = [&](double u, double v, double w) {
    const auto [a, b, c] = test::oracle::derivatives(ElementType::hexahedron, corners, {u, v, w});
    return dot(a, cross(b, c));
  };
  for (int part = 0; part < 8; ++part) {
    const double u = part & 1, v = part >> 1 & 1, w = part >> 2;
    const auto half = whole.half(0, u > 0).half(1, v > 0).half(2, w > 0);
    for (int n = 0; n < 8; ++n) {
      const int i = n & 1, j = n >> 1 & 1, k = n >> 2;
      EXPECT_NEAR(half.at[2 * i][2 * j][2 * k], value((u + i) / 2, (v + j) / 2, (w + k) / 2),
                  1e-14);
    }
  }
}

/// An element whose Jacobian is positive everywhere keeps it so by every method, and one that is
/// negative between its corners counts as inverted.
TEST(Jacobian, StaysPositiveByEveryMethod) {
  int moved = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const ElementType type = seed % 2 == 0 ? ElementType::hexahedron : ElementType::wedge;
    Mesh mesh = test::noisy(test::lattice(type, 3), 0.45, seed);
    const std::int64_t inverted = measure_quality(mesh).inverted_count;
    for (const test::Way& way : test::ways(false)) {
      SmoothOptions options{.method = way.method, .form = way.form, .max_iterations = 5};
      const test::Job job = test::smooth(mesh, options);
      EXPECT_LE(job.summary.quality_after.inverted_count, inverted) << way.name << " " << seed;
      moved += job.summary.nodes.moved > 0 ? 1 : 0;
      if (inverted > 0) continue;
      EXPECT_EQ(job.summary.quality_after.degenerate_count, 0) << way.name << " " << seed;
    }
  }
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace meshsmooth
