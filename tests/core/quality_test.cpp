#include "meshsmooth/quality.hpp"

#include <gmock/gmock.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>

#include "support/jacobian_oracle.hpp"
#include "support/oracle.hpp"

namespace meshsmooth {
namespace {

using test::oracle::Points;
using test::oracle::to_point;
using testing::Each;
using testing::ElementsAre;
using testing::Field;

constexpr Vec3d kUp{0, 0, 1};

double degrees(double cosine) { return std::acos(cosine) * 180 / std::numbers::pi; }

ElementMeasure measure(ElementType type, const std::vector<Vec3d>& p) {
  return measure_element(type, p.data(), kUp);
}

/// The ideal element with every node moved by up to `amplitude`; surface
/// elements stay in their plane.
std::vector<Vec3d> shaken(ElementType type, double amplitude, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(-amplitude, amplitude);
  std::vector<Vec3d> p = test::ideal_points(type);
  for (Vec3d& x : p) {
    const Vec3d move{noise(random), noise(random), noise(random)};
    x += test::oracle::is_surface(type) ? Vec3d{move.x, move.y, 0} : move;
  }
  return p;
}

const MetricStats& stats_of(const QualityStats& stats, QualityMetric metric) {
  for (const MetricStats& s : stats.metrics) {
    if (s.metric == metric) return s;
  }
  throw std::runtime_error("no such metric");
}

void expect_same_bits(const QualityStats& a, const QualityStats& b) {
  EXPECT_EQ(a.element_count, b.element_count);
  EXPECT_EQ(a.inverted_count, b.inverted_count);
  EXPECT_EQ(a.degenerate_count, b.degenerate_count);
  EXPECT_EQ(a.sum_absolute_volume, b.sum_absolute_volume);
  EXPECT_EQ(a.enclosed_volume, b.enclosed_volume);
  ASSERT_EQ(a.metrics.size(), b.metrics.size());
  for (std::size_t m = 0; m < a.metrics.size(); ++m) {
    EXPECT_EQ(a.metrics[m].metric, b.metrics[m].metric);
    EXPECT_EQ(a.metrics[m].min, b.metrics[m].min);
    EXPECT_EQ(a.metrics[m].percentile_1, b.metrics[m].percentile_1);
    EXPECT_EQ(a.metrics[m].mean, b.metrics[m].mean);
    EXPECT_EQ(a.metrics[m].max, b.metrics[m].max);
    EXPECT_EQ(a.metrics[m].histogram, b.metrics[m].histogram);
  }
  ASSERT_EQ(a.worst.size(), b.worst.size());
  for (std::size_t w = 0; w < a.worst.size(); ++w) {
    EXPECT_EQ(a.worst[w].element, b.worst[w].element);
    EXPECT_EQ(a.worst[w].mean_ratio, b.worst[w].mean_ratio);
    EXPECT_EQ(a.worst[w].scaled_jacobian, b.worst[w].scaled_jacobian);
  }
}

// --- one element --------------------------------------------------------------

class MeasureEveryElement : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(MeasureElement, MeasureEveryElement, testing::ValuesIn(kLinearTypes),
                         [](const auto& param) { return std::string(element_name(param.param)); });

TEST_P(MeasureEveryElement, IsWorthOneWhenIdeal) {
  const ElementMeasure m = measure(GetParam(), test::ideal_points(GetParam()));

  EXPECT_NEAR(m.mean_ratio, 1, 1e-15);
  EXPECT_NEAR(m.scaled_jacobian, 1, 1e-15);
  EXPECT_FALSE(m.inverted);
  EXPECT_FALSE(m.degenerate);
}

TEST_P(MeasureEveryElement, IsMeasuredAsByTheTextbook) {
  int inverted = 0;
  for (unsigned seed = 0; seed < 500; ++seed) {
    const std::vector<Vec3d> p = shaken(GetParam(), seed < 250 ? 0.2 : 0.7, seed);
    Points q;
    for (const Vec3d& x : p) q.push_back(to_point(x));

    const ElementMeasure m = measure(GetParam(), p);
    const test::oracle::Quality expected = test::oracle::quality(GetParam(), q);

    EXPECT_NEAR(m.mean_ratio, expected.mean_ratio, 1e-10) << "seed " << seed;
    EXPECT_NEAR(m.scaled_jacobian, expected.scaled_jacobian, 1e-12) << "seed " << seed;
    const bool inside = test::oracle::has_inside(GetParam()) && expected.mean_ratio > 0 &&
                        test::oracle::is_negative_somewhere(GetParam(), p).value_or(m.inverted);
    EXPECT_EQ(m.inverted, expected.mean_ratio < 0 || inside) << "seed " << seed;
    EXPECT_FALSE(m.degenerate);
    inverted += m.inverted ? 1 : 0;
    if (GetParam() == ElementType::tetrahedron) {
      EXPECT_NEAR(m.volume, expected.volume, 1e-15);
      EXPECT_NEAR(m.radius_ratio, expected.radius_ratio, 1e-10) << "seed " << seed;
      EXPECT_NEAR(degrees(m.min_angle_cos), expected.min_angle, 1e-6) << "seed " << seed;
      EXPECT_NEAR(degrees(m.max_angle_cos), expected.max_angle, 1e-6) << "seed " << seed;
    } else if (GetParam() == ElementType::triangle) {
      EXPECT_NEAR(m.volume, expected.volume, 1e-15);
      if (m.inverted) continue;
      EXPECT_NEAR(degrees(m.min_angle_cos), expected.min_angle, 1e-6) << "seed " << seed;
      EXPECT_NEAR(degrees(m.max_angle_cos), expected.max_angle, 1e-6) << "seed " << seed;
    } else if (GetParam() == ElementType::hexahedron) {
      EXPECT_NEAR(m.volume, test::oracle::hexahedron_volume(q), 1e-14);
    } else if (GetParam() == ElementType::wedge) {
      EXPECT_NEAR(std::abs(m.volume),
                  std::abs(test::oracle::hexahedron_volume(
                      {q[0], q[1], q[2], q[2], q[3], q[4], q[5], q[5]})),
                  1e-14);
    }
  }
  EXPECT_GT(inverted, 5) << "the test has not seen inverted elements";
}

TEST_P(MeasureEveryElement, IsWorthTheSameWhenMovedAndTurned) {
  const auto turn = [](Vec3d p) {  // about z, so that plane elements keep theirs
    return Vec3d{0.6 * p.x - 0.8 * p.y + 3, 0.8 * p.x + 0.6 * p.y - 2, p.z + 1};
  };
  for (unsigned seed = 0; seed < 50; ++seed) {
    const std::vector<Vec3d> p = shaken(GetParam(), 0.3, seed);
    std::vector<Vec3d> q;
    for (const Vec3d& x : p) q.push_back(turn(x));

    const ElementMeasure a = measure(GetParam(), p), b = measure(GetParam(), q);

    EXPECT_NEAR(a.mean_ratio, b.mean_ratio, 1e-11);
    EXPECT_NEAR(a.scaled_jacobian, b.scaled_jacobian, 1e-12);
    EXPECT_NEAR(a.radius_ratio, b.radius_ratio, 1e-11);
    EXPECT_NEAR(a.volume, b.volume, 1e-13);
    EXPECT_EQ(a.inverted, b.inverted);
  }
}

TEST_P(MeasureEveryElement, IsWorthTheSameBitsWhenScaledByAPowerOfTwo) {
  for (const double scale : {std::ldexp(1.0, -30), std::ldexp(1.0, 40)}) {
    for (unsigned seed = 0; seed < 50; ++seed) {
      const std::vector<Vec3d> p = shaken(GetParam(), 0.5, seed);
      std::vector<Vec3d> q;
      for (const Vec3d& x : p) q.push_back(scale * x);

      const ElementMeasure a = measure(GetParam(), p), b = measure(GetParam(), q);

      EXPECT_EQ(a.scaled_jacobian, b.scaled_jacobian);
      EXPECT_EQ(a.radius_ratio, b.radius_ratio);
      EXPECT_EQ(a.min_angle_cos, b.min_angle_cos);
      EXPECT_EQ(a.inverted, b.inverted);
      EXPECT_EQ(a.mean_ratio, b.mean_ratio);
    }
  }
}

TEST_P(MeasureEveryElement, IsInvertedWhenMirrored) {
  std::vector<Vec3d> p = test::ideal_points(GetParam());
  for (Vec3d& x : p) x.x = -x.x;

  const ElementMeasure m = measure(GetParam(), p);

  EXPECT_TRUE(m.inverted);
  EXPECT_NEAR(m.mean_ratio, -1, 1e-15);
  EXPECT_NEAR(m.scaled_jacobian, -1, 1e-15);
  EXPECT_LT(m.volume, 0);
}

TEST_P(MeasureEveryElement, IsDegenerateWhenAnEdgeHasNoLength) {
  std::vector<Vec3d> p = test::ideal_points(GetParam());
  p[1] = p[0];

  const ElementMeasure m = measure(GetParam(), p);

  EXPECT_TRUE(m.degenerate || m.inverted);
  EXPECT_LE(m.mean_ratio, 0);
  EXPECT_LE(m.scaled_jacobian, 0);
}

TEST_P(MeasureEveryElement, IsDegenerateInOnePoint) {
  const std::vector<Vec3d> p(test::ideal_points(GetParam()).size(), Vec3d{1, 2, 3});

  const ElementMeasure m = measure(GetParam(), p);

  EXPECT_TRUE(m.degenerate);
  EXPECT_FALSE(m.inverted);
  EXPECT_EQ(m.mean_ratio, 0);
  EXPECT_EQ(m.scaled_jacobian, 0);
  EXPECT_EQ(m.radius_ratio, 0);
  EXPECT_EQ(m.volume, 0);
}

TEST(MeasureElement, KnowsTheCornerTetrahedronOfACube) {
  const ElementMeasure m =
      measure(ElementType::tetrahedron, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});

  EXPECT_DOUBLE_EQ(m.volume, 1.0 / 6);
  EXPECT_NEAR(m.mean_ratio, 6 * std::cbrt(2.0) / 9, 1e-15);  // 12 (3 V)^(2/3) / sum l^2
  EXPECT_NEAR(m.scaled_jacobian, std::sqrt(2.0) / 2, 1e-15);
  // inradius 1 / (3 + root3), circumradius root3 / 2
  EXPECT_NEAR(m.radius_ratio, 3 / (3 + std::sqrt(3.0)) / (std::sqrt(3.0) / 2), 1e-15);
  EXPECT_NEAR(degrees(m.min_angle_cos), degrees(1 / std::sqrt(3.0)), 1e-12);
  EXPECT_NEAR(degrees(m.max_angle_cos), 90, 1e-12);
}

TEST(MeasureElement, KnowsTheAnglesOfTheRegularTetrahedron) {
  const ElementMeasure m =
      measure(ElementType::tetrahedron, test::ideal_points(ElementType::tetrahedron));

  EXPECT_NEAR(m.min_angle_cos, 1.0 / 3, 1e-15);
  EXPECT_NEAR(m.max_angle_cos, 1.0 / 3, 1e-15);
  EXPECT_NEAR(m.radius_ratio, 1, 1e-15);
}

TEST(MeasureElement, LooksAtAllSixDihedralAngles) {
  // The sharp edge in turn at every edge: the same element, its nodes permuted.
  const std::vector<Vec3d> p = {{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, 1, 0.1}};
  std::vector<int> order = {0, 1, 2, 3};
  const double sharp = std::atan2(0.1, 1.0) * 180 / std::numbers::pi;
  do {
    std::vector<Vec3d> q;
    for (const int n : order) q.push_back(p[n]);
    const ElementMeasure m = measure(ElementType::tetrahedron, q);
    if (m.inverted) continue;

    EXPECT_NEAR(degrees(m.min_angle_cos), sharp, 1e-9);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(MeasureElement, CallsASliverDegenerateOnlyBelowTheSignBound) {
  const auto sliver = [](double height) {
    return measure(ElementType::tetrahedron, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, height}});
  };

  EXPECT_FALSE(sliver(1e-12).degenerate);
  EXPECT_FALSE(sliver(1e-12).inverted);
  EXPECT_TRUE(sliver(1e-16).degenerate);
  EXPECT_FALSE(sliver(1e-16).inverted);
  EXPECT_TRUE(sliver(0).degenerate);
  EXPECT_TRUE(sliver(-1e-16).degenerate);
  EXPECT_TRUE(sliver(-1e-12).inverted);
  EXPECT_FALSE(sliver(-1e-12).degenerate);
}

TEST(MeasureElement, GivesInvertedElementsTheWorstAngles) {
  const ElementMeasure tet =
      measure(ElementType::tetrahedron, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}});
  const ElementMeasure triangle = measure(ElementType::triangle, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}});

  for (const ElementMeasure& m : {tet, triangle}) {
    EXPECT_TRUE(m.inverted);
    EXPECT_EQ(degrees(m.min_angle_cos), 0);
    EXPECT_EQ(degrees(m.max_angle_cos), 180);
  }
}

TEST(MeasureElement, FindsTheOneFoldedCornerOfAHexahedron) {
  std::vector<Vec3d> p = test::ideal_points(ElementType::hexahedron);
  p[6] = {0.3, 0.3, 0.3};  // pushed through the plane of its neighbours

  const ElementMeasure m = measure(ElementType::hexahedron, p);

  EXPECT_TRUE(m.inverted);
  EXPECT_GT(m.volume, 0);
}

TEST(MeasureElement, TakesASurfaceElementWithoutReferenceAsItLies) {
  const std::vector<Vec3d> p = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}};

  const ElementMeasure m = measure_element(ElementType::triangle, p.data(), {0, 0, 0});

  EXPECT_FALSE(m.inverted);
  EXPECT_FALSE(m.degenerate);
  EXPECT_DOUBLE_EQ(m.volume, 0.5);
}

TEST(MeasureElement, CallsNothingInvertedBecauseProductsOverflowOrVanish) {
  for (const double scale : {1e-200, 1e-120, 1e120, 1e200}) {
    for (const ElementType type : kLinearTypes) {
      const Mesh mesh = test::mapped(test::single(type), [&](Vec3d p) { return scale * p; });

      const QualityStats stats = measure_quality(mesh);

      EXPECT_EQ(stats.inverted_count, 0) << scale << " " << element_name(type);
      for (const MetricStats& metric : stats.metrics) {
        EXPECT_TRUE(std::isfinite(metric.mean)) << scale << " " << element_name(type);
      }
    }
  }
}

// --- orientation --------------------------------------------------------------

SurfaceOrientation orientation_of(const Mesh& mesh) {
  return {MeshTopology(mesh).view(), mesh.positions_view()};
}

TEST(SurfaceOrientation, KeepsNothingOfAVolumeMesh) {
  const SurfaceOrientation orientation = orientation_of(test::tet_ball());

  EXPECT_FALSE(orientation.plane());
  EXPECT_EQ(orientation.reference(3), (Vec3d{0, 0, 0}));
}

TEST(SurfaceOrientation, FindsThePlaneInAnyPositionAndPrecision) {
  const auto tilt = [](Vec3d p) {
    return Vec3d{0.6 * p.x + 100, p.y * 0.28 + 0.96 * 0.8 * p.x, -0.96 * p.y + 0.28 * 0.8 * p.x};
  };
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const Mesh flat = test::noisy(test::lattice(type, 6), 0.2, 1);
    const Mesh tilted = test::mapped(flat, tilt);

    const SurfaceOrientation orientation = orientation_of(tilted);

    EXPECT_EQ(orientation_of(flat).reference(0), kUp);
    EXPECT_TRUE(orientation.plane());
    EXPECT_TRUE(orientation_of(test::as_float32(tilted)).plane());
    const Vec3d normal = orientation.reference(0);
    EXPECT_NEAR(normal.x, -0.8, 1e-12);
    EXPECT_NEAR(normal.y, 0.6 * 0.96, 1e-12);
    EXPECT_NEAR(normal.z, 0.6 * 0.28, 1e-12);
  }
}

TEST(SurfaceOrientation, TakesTheSideOfTheMajority) {
  const Mesh mesh = test::inverted(test::lattice(ElementType::triangle, 3));
  Mesh one_turned = mesh;
  std::swap(one_turned.blocks[0].nodes[0], one_turned.blocks[0].nodes[1]);

  EXPECT_EQ(orientation_of(mesh).reference(0), (Vec3d{0, 0, -1}));
  EXPECT_EQ(measure_quality(mesh).inverted_count, 0);
  const MeshTopology topology(one_turned);
  const QualityStats stats =
      measure_quality(topology.view(), one_turned.positions_view(), orientation_of(one_turned));
  EXPECT_EQ(stats.inverted_count, 1);
  EXPECT_EQ(stats.worst.front().element, 0);
  EXPECT_EQ(measure_quality(one_turned).inverted_count, 0) << "it is numbered the other way round";
}

TEST(SurfaceOrientation, TakesEachElementsOwnNormalOnACurvedSurface) {
  const Mesh mesh = test::open_cone(5);

  const SurfaceOrientation orientation = orientation_of(mesh);

  EXPECT_FALSE(orientation.plane());
  const auto& nodes = mesh.blocks[0].nodes;
  for (std::size_t e = 0; e < 5; ++e) {
    const Vec3d a = test::points(mesh)[nodes[3 * e]], b = test::points(mesh)[nodes[3 * e + 1]],
                c = test::points(mesh)[nodes[3 * e + 2]];
    const Vec3d normal = cross(b - a, c - a);
    EXPECT_NEAR(norm(orientation.reference(e)), 1, 0.01);
    EXPECT_GT(dot(orientation.reference(e), normal),
              0.9999 * norm(normal) * norm(orientation.reference(e)));
  }
  EXPECT_EQ(measure_quality(mesh).inverted_count, 0);
}

TEST(SurfaceOrientation, CountsElementsThatTurnOverOnACurvedSurface) {
  const Mesh before = test::open_cone(5);
  Mesh after = before;
  test::points(after)[0] = {5, 0, 0.2};  // the apex far outside its ring

  const QualityStats stats =
      measure_quality(MeshTopology(after).view(), after.positions_view(), orientation_of(before));

  EXPECT_GT(stats.inverted_count, 0);
  EXPECT_LT(stats.inverted_count, 5);
}

TEST(SurfaceOrientation, DoesNotTakeALineForAPlane) {
  const Mesh mesh =
      test::make_mesh({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{ElementType::triangle, {0, 1, 2}}});

  EXPECT_FALSE(orientation_of(mesh).plane());
  EXPECT_EQ(measure_quality(mesh).degenerate_count, 1);
}

// --- a whole mesh -------------------------------------------------------------

TEST(MeasureQuality, AgreesWithTheMeasuresOfTheElements) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 12), 0.3, 5);
  const std::vector<Vec3d>& p = test::points(mesh);
  std::vector<double> ratios;
  double volume = 0;
  std::int64_t inverted = 0;
  for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
    const ElementMeasure m =
        measure(e.type, {p[e.nodes[0]], p[e.nodes[1]], p[e.nodes[2]], p[e.nodes[3]]});
    ratios.push_back(m.mean_ratio);
    volume += std::abs(m.volume);
    inverted += m.inverted ? 1 : 0;
  }
  std::sort(ratios.begin(), ratios.end());

  const QualityStats stats = measure_quality(mesh);
  const MetricStats& mean_ratio = stats_of(stats, QualityMetric::mean_ratio);

  const auto count = static_cast<double>(ratios.size());
  EXPECT_EQ(stats.element_count, static_cast<std::int64_t>(ratios.size()));
  EXPECT_GT(inverted, 0);
  EXPECT_EQ(stats.inverted_count, inverted);
  EXPECT_EQ(stats.degenerate_count, 0);
  EXPECT_NEAR(stats.sum_absolute_volume, volume, 1e-9);
  EXPECT_EQ(mean_ratio.element_count, stats.element_count);
  EXPECT_EQ(mean_ratio.min, ratios.front());
  EXPECT_EQ(mean_ratio.max, ratios.back());
  EXPECT_NEAR(mean_ratio.mean, std::accumulate(ratios.begin(), ratios.end(), 0.0) / count, 1e-13);
  ASSERT_EQ(stats.worst.size(), 10U);
  for (std::size_t w = 0; w < 10; ++w) EXPECT_EQ(stats.worst[w].mean_ratio, ratios[w]);

  const double one_percent = ratios[ratios.size() / 100];
  EXPECT_LE(mean_ratio.percentile_1, one_percent);
  EXPECT_GT(mean_ratio.percentile_1, one_percent - 2 * 2.0 / 2048);
}

TEST(MeasureQuality, FillsHistogramsThatCoverAllElements) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 6), 0.2, 5);

  const QualityStats stats = measure_quality(mesh);

  std::vector<QualityMetric> metrics;
  for (const MetricStats& metric : stats.metrics) {
    metrics.push_back(metric.metric);
    ASSERT_EQ(metric.histogram.size(), 32U);
    EXPECT_EQ(std::accumulate(metric.histogram.begin(), metric.histogram.end(), std::int64_t{0}),
              metric.element_count);
    const double width = (metric.histogram_upper - metric.histogram_lower) / 32;
    for (std::size_t b = 0; b < 32; ++b) {
      if (metric.histogram[b] == 0) continue;
      const double lower = metric.histogram_lower + width * static_cast<double>(b);
      EXPECT_LE(metric.min, lower + width) << metric_name(metric.metric);
      EXPECT_GE(metric.max, lower) << metric_name(metric.metric);
    }
    EXPECT_LE(metric.min, metric.percentile_1);
    EXPECT_LE(metric.percentile_1, metric.mean);
    EXPECT_LE(metric.mean, metric.max);
  }
  EXPECT_THAT(metrics, ElementsAre(QualityMetric::mean_ratio, QualityMetric::scaled_jacobian,
                                   QualityMetric::radius_ratio, QualityMetric::min_dihedral_angle,
                                   QualityMetric::max_dihedral_angle));
}

TEST(MeasureQuality, CountsMetricsOnlyWhereTheyAreDefined) {
  const QualityStats mixed = measure_quality(test::mixed_stack(2));
  const QualityStats triangles = measure_quality(test::lattice(ElementType::triangle, 2));

  EXPECT_EQ(mixed.element_count, 56);
  EXPECT_EQ(mixed.inverted_count, 0);
  EXPECT_EQ(mixed.degenerate_count, 0);
  EXPECT_NEAR(mixed.sum_absolute_volume, 12, 1e-13);
  EXPECT_EQ(stats_of(mixed, QualityMetric::mean_ratio).element_count, 56);
  EXPECT_EQ(stats_of(mixed, QualityMetric::radius_ratio).element_count, 40);
  EXPECT_EQ(stats_of(triangles, QualityMetric::min_angle).element_count, 8);
  EXPECT_NEAR(stats_of(triangles, QualityMetric::min_angle).min, 45, 1e-12);
  EXPECT_NEAR(stats_of(triangles, QualityMetric::max_angle).max, 90, 1e-12);
  EXPECT_EQ(triangles.metrics.size(), 4U);
}

TEST(MeasureQuality, FindsEveryLatticeValidAndOfItsVolume) {
  for (const ElementType type : kLinearTypes) {
    const QualityStats stats = measure_quality(test::lattice(type, 3));

    EXPECT_EQ(stats.inverted_count, 0) << element_name(type);
    EXPECT_EQ(stats.degenerate_count, 0);
    EXPECT_NEAR(stats.sum_absolute_volume, test::oracle::is_surface(type) ? 9 : 27, 1e-12);
  }
}

/// Of the facets that stand alone, each a fan of triangles around the mean of its nodes,
/// which for a bilinear patch has the patch's cone.
double volume_inside_boundary(const Mesh& mesh) {
  const std::vector<Vec3d>& p = test::points(mesh);
  std::map<std::vector<NodeId>, std::vector<std::vector<NodeId>>> uses;
  for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
    const ElementShape& shape = element_shape(e.type);
    for (int f = 0; f < shape.facet_count; ++f) {
      std::vector<NodeId> nodes;
      for (int n = 0; n < shape.facets[f].node_count; ++n) {
        nodes.push_back(e.nodes[static_cast<std::size_t>(shape.facets[f].nodes[n])]);
      }
      std::vector<NodeId> key = nodes;
      std::ranges::sort(key);
      uses[key].push_back(nodes);
    }
  }
  double volume = 0;
  for (const auto& [key, facets] : uses) {
    if (facets.size() != 1) continue;
    const std::vector<NodeId>& nodes = facets[0];
    Vec3d centre{0, 0, 0};
    for (const NodeId n : nodes) centre += (1.0 / static_cast<double>(nodes.size())) * p[n];
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      volume += dot(centre, cross(p[nodes[n]], p[nodes[(n + 1) % nodes.size()]])) / 6;
    }
  }
  return volume;
}

/// With a boundary that is curved, so that its facets of four nodes are not plane.
Mesh warped(Mesh mesh) {
  for (Vec3d& p : test::points(mesh)) {
    p += Vec3d{0.02 * p.y * p.z, 0.03 * p.x * p.z, 0.01 * p.x * p.y};
  }
  return mesh;
}

TEST(MeasureQuality, FindsWhatTheBoundaryEncloses) {
  for (const ElementType type : kLinearTypes) {
    if (test::oracle::is_surface(type)) continue;
    const Mesh good = warped(test::noisy(test::lattice(type, 4), 0.1, 8));
    const Mesh tangled = warped(test::noisy(test::lattice(type, 4), 0.6, 8));
    for (const Mesh& mesh : {good, tangled}) {
      EXPECT_NEAR(measure_quality(mesh).enclosed_volume, volume_inside_boundary(mesh), 1e-11)
          << element_name(type);
    }
    const QualityStats valid = measure_quality(good), overlapping = measure_quality(tangled);
    EXPECT_EQ(valid.inverted_count, 0);
    EXPECT_NEAR(valid.sum_absolute_volume, valid.enclosed_volume, 1e-11);
    EXPECT_GT(overlapping.inverted_count, 0);
    // Others can be inverted at a corner and yet have their volume.
    if (type == ElementType::tetrahedron) {
      EXPECT_GT(overlapping.sum_absolute_volume, overlapping.enclosed_volume + 0.1);
    }
  }
  const Mesh mixed = warped(test::noisy(test::mixed_stack(3), 0.2, 8));
  EXPECT_NEAR(measure_quality(mixed).enclosed_volume, volume_inside_boundary(mixed), 1e-11);
  EXPECT_EQ(measure_quality(test::lattice(ElementType::quad, 3)).enclosed_volume, 0);
}

TEST(MeasureQuality, EvaluatesAMeshWithReversedNodeOrderAsIfItWereNot) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::pyramid, ElementType::wedge,
                                 ElementType::hexahedron}) {
    const QualityStats stats = measure_quality(test::inverted(test::lattice(type, 2)));

    EXPECT_EQ(stats.mirrored_count, stats.element_count) << element_name(type);
    EXPECT_EQ(stats.inverted_count, 0);
  }
}

TEST(MeasureQuality, BreaksTiesAmongTheWorstByTheLowestId) {
  const QualityStats stats = measure_quality(test::lattice(ElementType::hexahedron, 4));

  std::vector<std::int64_t> ids;
  for (const ElementQuality& worst : stats.worst) ids.push_back(worst.element);
  EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST(MeasureQuality, ListsTheWorstByTheirNames) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 4);
  std::vector<std::uint32_t> names(mesh.element_count());
  for (std::size_t e = 0; e < names.size(); ++e) {
    names[e] = static_cast<std::uint32_t>(1000 - e);
  }
  const MeshTopology topology(mesh);
  const std::vector<std::uint8_t> fixed(mesh.node_count(), 1);

  const QualityStats stats = measure_quality(topology.view(), mesh.positions_view(), {}, names);
  const LockedStats locked =
      measure_locked(topology.view(), fixed, mesh.positions_view(), {}, names);

  EXPECT_EQ(stats.worst.front().element, 1000 - 63);
  EXPECT_EQ(stats.worst.back().element, 1000 - 54);
  EXPECT_EQ(locked.worst->element, 1000 - 63);
}

TEST(MeasureQuality, ListsFewerWorstWhenThereAreFewerElements) {
  const QualityStats stats = measure_quality(test::two_tets());

  EXPECT_EQ(stats.worst.size(), 2U);
  EXPECT_THAT(stats.worst, Each(Field(&ElementQuality::type, ElementType::tetrahedron)));
}

TEST(MeasureQuality, GivesTheSameBitsForEveryNumberOfThreads) {
  const tbb::global_control enough(tbb::global_control::max_allowed_parallelism, 5);
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 22), 0.25, 9);
  ASSERT_GT(mesh.element_count(), 7 * 8192U);
  const QualityStats expected = tbb::task_arena(1).execute([&] { return measure_quality(mesh); });

  for (const int threads : {2, 5, 5, 5}) {
    const QualityStats stats =
        tbb::task_arena(threads).execute([&] { return measure_quality(mesh); });
    expect_same_bits(expected, stats);
  }
}

TEST(MeasureQuality, GivesTheSameBitsWhenScaledByAPowerOfTwo) {
  const Mesh mesh = test::noisy(test::mixed_stack(4), 0.2, 3);
  QualityStats large =
      measure_quality(test::mapped(mesh, [](Vec3d p) { return std::ldexp(1.0, 20) * p; }));
  const QualityStats stats = measure_quality(mesh);

  EXPECT_EQ(large.sum_absolute_volume, std::ldexp(stats.sum_absolute_volume, 60));
  large.sum_absolute_volume = stats.sum_absolute_volume;
  EXPECT_EQ(large.enclosed_volume, std::ldexp(stats.enclosed_volume, 60));
  large.enclosed_volume = stats.enclosed_volume;
  expect_same_bits(stats, large);
}

TEST(MeasureQuality, MeasuresFloat32FromTheStoredCoordinates) {
  const Mesh single_precision =
      test::as_float32(test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.2, 3));
  Mesh widened = single_precision;
  widened.positions = test::points_as_double(single_precision);

  expect_same_bits(measure_quality(single_precision), measure_quality(widened));
}

TEST(MetricName, NamesEveryMetric) {
  EXPECT_EQ(metric_name(QualityMetric::mean_ratio), "mean_ratio");
  EXPECT_EQ(metric_name(QualityMetric::min_dihedral_angle), "min_dihedral_angle");
  EXPECT_EQ(metric_name(QualityMetric::max_angle), "max_angle");
}

// --- locked elements ----------------------------------------------------------

LockedStats locked(const Mesh& mesh, const std::vector<std::uint8_t>& fixed) {
  return measure_locked(MeshTopology(mesh).view(), fixed, mesh.positions_view(),
                        orientation_of(mesh));
}

TEST(MeasureLocked, CountsElementsWhoseNodesAreAllFixed) {
  Mesh mesh = test::two_tets();
  test::points(mesh)[4].z = 0.1;  // the second becomes inverted

  const LockedStats none = locked(mesh, {1, 1, 1, 0, 0});
  const LockedStats one = locked(mesh, {1, 1, 1, 0, 7});
  const LockedStats both = locked(mesh, {1, 1, 1, 1, 1});

  EXPECT_EQ(none.element_count, 0);
  EXPECT_FALSE(none.worst);
  EXPECT_EQ(one.element_count, 1);
  EXPECT_EQ(one.inverted_count, 1);
  EXPECT_EQ(one.worst->element, 1);
  EXPECT_EQ(both.element_count, 2);
  EXPECT_EQ(both.inverted_count, 1);
  EXPECT_EQ(both.worst->element, 1);
  EXPECT_EQ(both.worst->mean_ratio, measure_quality(mesh).worst[0].mean_ratio);
}

TEST(MeasureLocked, NamesTheLowestOfEquallyBadElements) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 3);

  const LockedStats stats = locked(mesh, std::vector<std::uint8_t>(mesh.node_count(), 1));

  EXPECT_EQ(stats.element_count, 27);
  EXPECT_EQ(stats.worst->element, 0);
}

}  // namespace
}  // namespace meshsmooth
