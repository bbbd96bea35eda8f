// Metrics of every element in one table.

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>

#include "mesh/accumulator.hpp"
#include "mesh/curved_jacobian.hpp"
#include "mesh/face_metrics.hpp"
#include "mesh/measure.hpp"
#include "mesh/parallel.hpp"
#include "meshsmooth/shape_metrics.hpp"

namespace meshsmooth {
namespace {

using namespace detail;

bool of_faces(ElementMetric metric) {
  return metric == ElementMetric(ShapeMetric::non_orthogonality) ||
         metric == ElementMetric(ShapeMetric::skewness);
}

/// What an element has by itself.
void measure_alone(ElementType type, const Vec3d* nodes, Vec3d reference, std::size_t element,
                   ElementTable& table) {
  const ElementShape& shape = element_shape(type);
  const ElementMeasure measure = detail::measure_nodes(type, nodes, reference);
  table.states[element] = measure.inverted     ? ElementState::inverted
                          : measure.degenerate ? ElementState::degenerate
                                               : ElementState::valid;
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    if (of_faces(table.metrics[m])) continue;
    double& value = table.columns[m][element];
    if (const auto* own = std::get_if<ShapeMetric>(&table.metrics[m])) {
      value = measure_shape(linear_type(type), nodes, *own);
      continue;
    }
    for_each_metric(shape, measure, [&](int, QualityMetric metric, double measured) {
      if (ElementMetric(metric) == table.metrics[m]) value = finite_measure(measured);
    });
  }
}

}  // namespace

ElementTable tabulate_elements(const TopologyView& topology, const PositionsView& positions,
                               const SurfaceOrientation& orientation,
                               std::vector<ElementMetric> metrics) {
  const std::size_t element_count = topology.element_count();
  ElementTable table;
  table.metrics = std::move(metrics);
  table.columns.assign(table.metrics.size(),
                       std::vector(element_count, std::numeric_limits<double>::quiet_NaN()));
  table.states.resize(element_count);
  const auto measure_all = [&](auto places) {
    std::size_t first = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const std::size_t width = element_width(block.type);
      parallel_for_ranges(block.element_count(), [&](std::size_t begin, std::size_t end) {
        std::array<Vec3d, kMaxElementNodes> nodes{};
        for (std::size_t e = begin; e < end; ++e) {
          for (std::size_t n = 0; n < width; ++n) {
            nodes[n] = vec3_cast<double>(places[block.nodes[e * width + n]]);
          }
          measure_alone(block.type, nodes.data(), orientation.reference(first + e), first + e,
                        table);
        }
      });
      first += block.element_count();
    }
  };
  std::visit(measure_all, positions);

  const bool volume =
      !topology.blocks.empty() && element_shape(topology.blocks.front().type).dimension == 3;
  if (!volume || std::ranges::none_of(table.metrics, of_faces)) return table;
  FaceMetrics faces = measure_faces(topology, positions);
  table.faces = faces.stats;
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    if (!of_faces(table.metrics[m])) continue;
    const bool angles = table.metrics[m] == ElementMetric(ShapeMetric::non_orthogonality);
    table.columns[m] = angles ? faces.non_orthogonality : faces.skewness;
  }
  return table;
}

}  // namespace meshsmooth
