#include "meshsmooth/shape_metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "support/meshes.hpp"

namespace meshsmooth {
namespace {

using namespace test;
using ::testing::DoubleNear;
using ::testing::Each;

ElementTable tabulate(const Mesh& mesh, std::vector<ElementMetric> metrics = element_metrics()) {
  const MeshTopology topology(mesh);
  const PositionsView positions = mesh.positions_view();
  return tabulate_elements(topology.view(), positions,
                           SurfaceOrientation(topology.view(), positions), std::move(metrics));
}

TEST(ShapeMetrics, HaveNamesThatFindThem) {
  for (const ElementMetric metric : element_metrics()) {
    EXPECT_EQ(find_element_metric(element_metric_name(metric)), metric);
  }
  EXPECT_EQ(find_element_metric("beauty"), std::nullopt);
}

TEST(ShapeMetrics, AreIdealForIdealElements) {
  for (const ElementType type : kLinearTypes) {
    const std::vector<Vec3d> corners = ideal_points(type);
    for (const ShapeMetric metric : kShapeMetrics) {
      const double value = measure_shape(type, corners.data(), metric);
      if (metric == ShapeMetric::non_orthogonality || metric == ShapeMetric::skewness ||
          !has_element_metric(type, metric)) {
        EXPECT_TRUE(std::isnan(value));
      } else {
        EXPECT_NEAR(value, metric == ShapeMetric::equiangle_skew ? 0 : 1, 1e-13)
            << element_name(type) << ' ' << element_metric_name(metric);
      }
    }
  }
}

TEST(ShapeMetrics, AreInfiniteWhereNothingIsLeftOfAnElement) {
  const std::vector<Vec3d> point(kMaxCorners, Vec3d{1, 2, 3});
  for (const ElementType type : kLinearTypes) {
    for (const ShapeMetric metric :
         {ShapeMetric::aspect_ratio, ShapeMetric::edge_ratio, ShapeMetric::condition_number}) {
      if (!has_element_metric(type, metric)) continue;
      EXPECT_TRUE(std::isinf(measure_shape(type, point.data(), metric)));
    }
  }
}

TEST(ShapeMetrics, TableHasEveryMetricOfEveryElement) {
  const Mesh mesh = scattered_blocks();
  const ElementTable table = tabulate(mesh);
  const MeshTopology topology(mesh);
  std::size_t element = 0;
  for (const ElementBlock& block : mesh.blocks) {
    const auto width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      std::vector<Vec3d> corners;
      for (std::size_t n = 0; n < width; ++n) {
        corners.push_back(points(mesh)[static_cast<std::size_t>(block.nodes[at + n])]);
      }
      const ElementMeasure measure = measure_element(block.type, corners.data(), {});
      EXPECT_EQ(table.columns[0][element], measure.mean_ratio);
      EXPECT_EQ(table.columns[1][element], measure.scaled_jacobian);
      EXPECT_EQ(table.states[element] == ElementState::inverted, measure.inverted);
      for (std::size_t m = 0; m < table.metrics.size(); ++m) {
        EXPECT_EQ(std::isnan(table.columns[m][element]),
                  !has_element_metric(block.type, table.metrics[m]))
            << element_metric_name(table.metrics[m]);
      }
      const double edges = measure_shape(block.type, corners.data(), ShapeMetric::edge_ratio);
      EXPECT_EQ(table.columns[kQualityMetrics.size() + 1][element], edges);
    }
  }
}

TEST(ShapeMetrics, HaveTheSameBitsForAnyNumberOfThreads) {
  const Mesh mesh = noisy(lattice(ElementType::tetrahedron, 14), 0.2, 5);
  const auto bits = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const ElementTable table = tabulate(mesh);
    std::vector<std::uint64_t> all = {
        std::bit_cast<std::uint64_t>(table.faces->average_non_orthogonality)};
    for (const auto& column : table.columns) {
      for (const double value : column) all.push_back(std::bit_cast<std::uint64_t>(value));
    }
    return all;
  };
  EXPECT_EQ(bits(1), bits(4));
}

TEST(ShapeMetrics, FacesOfBoxesAreOrthogonal) {
  const ElementTable table = tabulate(lattice(ElementType::hexahedron, 4),
                                      {ShapeMetric::non_orthogonality, ShapeMetric::skewness});
  EXPECT_THAT(table.columns[0], Each(DoubleNear(0, 1e-6)));
  EXPECT_THAT(table.columns[1], Each(DoubleNear(0, 1e-12)));
  EXPECT_EQ(table.faces->internal_face_count, 3 * 3 * 16);
}

TEST(ShapeMetrics, FacesOfShearedBoxesHaveTheAngleOfTheShear) {
  const double angle = std::numbers::pi / 6;
  const Mesh mesh = mapped(lattice(ElementType::hexahedron, 3), [&](Vec3d p) {
    return p + Vec3d{p.z * std::tan(angle), 0, 0};
  });
  const ElementTable table = tabulate(mesh, {ShapeMetric::non_orthogonality});
  EXPECT_THAT(table.columns[0], Each(DoubleNear(30, 1e-9)));
  // The faces across x and z lean, those across y do not.
  EXPECT_NEAR(table.faces->average_non_orthogonality,
              std::acos((2 * std::cos(angle) + 1) / 3) * 180 / std::numbers::pi, 1e-9);
}

TEST(ShapeMetrics, AnElementWithoutANeighbourHasNoAngle) {
  const ElementTable table =
      tabulate(disconnected_pieces(), {ShapeMetric::non_orthogonality, ShapeMetric::skewness});
  for (const double value : table.columns[0]) EXPECT_TRUE(std::isnan(value));
  for (const double value : table.columns[1]) EXPECT_LT(value, 1e-6);
  EXPECT_EQ(table.faces->internal_face_count, 0);
}

TEST(ShapeMetrics, SurfacesHaveNoMetricsOfFaces) {
  const ElementTable table = tabulate(triangle_ring());
  EXPECT_FALSE(table.faces.has_value());
  for (const double value : table.columns.back()) EXPECT_TRUE(std::isnan(value));
}

}  // namespace
}  // namespace meshsmooth
