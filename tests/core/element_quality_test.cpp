// Metrics of every element of a result.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

using testing::HasSubstr;

const std::vector<QualityMetric> kAll(kQualityMetrics.begin(), kQualityMetrics.end());

double degrees(double cosine) { return std::acos(cosine) * (180 / 3.14159265358979323846); }

/// NaN where the type does not have the metric.
double value_of(ElementType type, const ElementMeasure& m, QualityMetric metric) {
  const bool tetrahedron = type == ElementType::tetrahedron;
  const bool triangle = type == ElementType::triangle;
  switch (metric) {
    case QualityMetric::mean_ratio:
      return m.mean_ratio;
    case QualityMetric::scaled_jacobian:
      return m.scaled_jacobian;
    case QualityMetric::radius_ratio:
      return tetrahedron ? m.radius_ratio : NAN;
    case QualityMetric::min_dihedral_angle:
      return tetrahedron ? degrees(m.min_angle_cos) : NAN;
    case QualityMetric::max_dihedral_angle:
      return tetrahedron ? degrees(m.max_angle_cos) : NAN;
    case QualityMetric::min_angle:
      return triangle ? degrees(m.min_angle_cos) : NAN;
    case QualityMetric::max_angle:
      return triangle ? degrees(m.max_angle_cos) : NAN;
  }
  return NAN;
}

/// Element by element, in the caller's order.
std::vector<float> measured_one_by_one(const Mesh& mesh, const SurfaceOrientation& orientation,
                                       const std::vector<QualityMetric>& metrics) {
  const std::vector<Vec3d> p = test::points_as_double(mesh);
  std::vector<float> values;
  for (const QualityMetric metric : metrics) {
    std::size_t id = 0;
    for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
      std::vector<Vec3d> corners;
      for (const NodeId n : e.nodes) corners.push_back(p[static_cast<std::size_t>(n)]);
      const ElementMeasure m = measure_element(e.type, corners.data(), orientation.reference(id++));
      values.push_back(static_cast<float>(value_of(e.type, m, metric)));
    }
  }
  return values;
}

bool equal_or_both_nan(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_same(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_TRUE(equal_or_both_nan(found[i], expected[i]))
        << "value " << i << ": " << found[i] << ", expected " << expected[i];
  }
}

SurfaceOrientation orientation_of(const Mesh& mesh) {
  return {MeshTopology(mesh).view(), mesh.positions_view()};
}

std::vector<std::pair<std::string, Mesh>> meshes() {
  std::vector<std::pair<std::string, Mesh>> result = {
      {"mixed", test::noisy(test::mixed_stack(9), 0.15, 1)},
      {"scattered blocks", test::scattered_blocks(11)},
      {"sphere", test::noisy(test::sphere(4), 0.01, 4)},
      {"tangled", test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.45, 7)},
  };
  for (const ElementType type : kLinearTypes) {
    const int n = element_shape(type).dimension == 2 ? 61 : 13;
    result.emplace_back(element_name(type), test::noisy(test::lattice(type, n), 0.2, 3));
  }
  return result;
}

TEST(MeasureElements, GivesEachElementItsOwnMeasures) {
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    const SurfaceOrientation orientation = orientation_of(mesh);

    const ElementQualityArrays found =
        measure_elements(MeshTopology(mesh).view(), mesh.positions_view(), orientation, kAll);

    EXPECT_EQ(found.metrics, kAll);
    expect_same(found.values, measured_one_by_one(mesh, orientation, kAll));
  }
}

TEST(MeasureElements, IsDefinedWhereTheTypeHasTheMetric) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::single(type);

    const ElementQualityArrays found = measure_elements(
        MeshTopology(mesh).view(), mesh.positions_view(), orientation_of(mesh), kAll);

    for (std::size_t m = 0; m < kAll.size(); ++m) {
      EXPECT_EQ(has_metric(type, kAll[m]), !std::isnan(found.of(m).front()))
          << element_name(type) << ", " << metric_name(kAll[m]);
    }
  }
}

TEST(MeasureElements, StoresByTheCallersIds) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::wedge, 5), 0.1, 3);
  const auto measured = [&](std::span<const std::uint32_t> ids) {
    return measure_elements(MeshTopology(mesh).view(), mesh.positions_view(), {},
                            {QualityMetric::scaled_jacobian}, ids)
        .values;
  };
  std::vector<std::uint32_t> backwards(mesh.element_count());
  for (std::size_t e = 0; e < backwards.size(); ++e) {
    backwards[e] = static_cast<std::uint32_t>(backwards.size() - 1 - e);
  }

  std::vector<float> reversed = measured(backwards);

  std::ranges::reverse(reversed);
  EXPECT_EQ(reversed, measured({}));
}

TEST(MeasureElements, GivesTheValuesThatTheStatisticsSummarize) {
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    const QualityStats stats = measure_quality(mesh);
    for (const MetricStats& metric : stats.metrics) {
      std::vector<float> values = measure_elements(MeshTopology(mesh).view(), mesh.positions_view(),
                                                   orientation_of(mesh), {metric.metric})
                                      .values;
      std::erase_if(values, [](float value) { return std::isnan(value); });

      EXPECT_EQ(static_cast<std::int64_t>(values.size()), metric.element_count);
      EXPECT_EQ(std::ranges::min(values), static_cast<float>(metric.min));
      EXPECT_EQ(std::ranges::max(values), static_cast<float>(metric.max));
    }
  }
}

TEST(FindMetric, FindsEachByItsName) {
  for (const QualityMetric metric : kQualityMetrics) {
    EXPECT_EQ(find_metric(metric_name(metric)), metric);
  }
  EXPECT_EQ(find_metric("mean ratio"), std::nullopt);
  EXPECT_EQ(find_metric(""), std::nullopt);
}

// --- of a job ------------------------------------------------------------------------

TEST(ElementQuality, IsThatOfTheResultInTheCallersOrder) {
  for (const auto& [name, mesh] : meshes()) {
    for (const bool float32 : {false, true}) {
      SCOPED_TRACE(name + (float32 ? ", float32" : ""));
      const Mesh start = float32 ? test::as_float32(mesh) : mesh;

      const test::Job job = test::smooth(
          start,
          {.method = SmartLaplacian{}, .max_iterations = 3, .element_quality_metrics = kAll});

      EXPECT_FALSE(test::same_bits(job.mesh, start));
      EXPECT_EQ(job.summary.element_quality.metrics, kAll);
      expect_same(job.summary.element_quality.values,
                  measured_one_by_one(job.mesh, orientation_of(start), kAll));
    }
  }
}

TEST(ElementQuality, IsTheSameOnAPreparedTopology) {
  const Mesh start = test::noisy(test::mixed_stack(9), 0.15, 1);
  const SmoothOptions options = {
      .method = SmartLaplacian{}, .max_iterations = 3, .element_quality_metrics = kAll};
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(start);
  const auto prepared = smoother->prepare(topology.view());
  Mesh mesh = start;

  const SmoothSummary summary =
      smoother->smooth(*prepared, mesh.positions_span(), options, JobControl());

  expect_same(summary.element_quality.values,
              measured_one_by_one(mesh, orientation_of(start), kAll));
}

TEST(ElementQuality, HasTheMetricsThatWereAskedForInTheirOrder) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.1, 3);
  const std::vector<QualityMetric> metrics = {QualityMetric::max_dihedral_angle,
                                              QualityMetric::mean_ratio};

  const test::Job job = test::smooth(mesh, {.max_iterations = 0,
                                            .quality_detail = QualityDetail::brief,
                                            .element_quality_metrics = metrics});

  EXPECT_EQ(job.summary.element_quality.metrics, metrics);
  expect_same(job.summary.element_quality.values, measured_one_by_one(mesh, {}, metrics));
  EXPECT_EQ(job.summary.element_quality.of(1).size(), mesh.element_count());
  EXPECT_EQ(std::ranges::min(job.summary.element_quality.of(1)),
            static_cast<float>(job.summary.quality_after.worst.front().mean_ratio));
}

TEST(ElementQuality, IsAbsentUnlessAskedFor) {
  const test::Job job = test::smooth(test::tet_ball(), {.max_iterations = 1});

  EXPECT_TRUE(job.summary.element_quality.metrics.empty());
  EXPECT_TRUE(job.summary.element_quality.values.empty());
}

TEST(ElementQuality, RefusesAMetricTwiceBeforeAnyWork) {
  try {
    test::smooth(test::tet_ball(),
                 {.element_quality_metrics = {QualityMetric::min_angle, QualityMetric::mean_ratio,
                                              QualityMetric::min_angle}});
    FAIL() << "accepted";
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.reason(), "OPTION_OUT_OF_RANGE");
    EXPECT_THAT(error.what(), HasSubstr("element_quality_metrics: min_angle"));
    ASSERT_EQ(error.details().size(), 1U);
    EXPECT_EQ(error.details().front().second, "element_quality_metrics");
  }
}

}  // namespace
}  // namespace meshsmooth
