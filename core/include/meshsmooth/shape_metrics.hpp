#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "meshsmooth/quality.hpp"

namespace meshsmooth {

inline constexpr auto kShapeMetrics = enum_values<ShapeMetric>();

/// Any metric of an element.
using ElementMetric = std::variant<QualityMetric, ShapeMetric>;

/// @returns the metric's name as in its enum
[[nodiscard]] std::string_view element_metric_name(ElementMetric metric);
/// @returns the metric of that name; nothing for an unknown name
[[nodiscard]] std::optional<ElementMetric> find_element_metric(std::string_view name);
/// @returns all metrics: those of quality.hpp, then those of this header
[[nodiscard]] std::vector<ElementMetric> element_metrics();
/// @returns whether the metric is defined for elements of the type
[[nodiscard]] bool has_element_metric(ElementType type, ElementMetric metric);

/// One of the metrics that an element has by itself: all but `non_orthogonality` and `skewness`.
/// Formulas: docs/quality.md. Sources: Stimpson et al., "The Verdict geometric quality library",
/// SAND2007-1751; equiangle skew by the Verdict of VTK 9.2.
///
/// @param corners  positions of its nodes in VTK order
/// @returns NaN where the metric is not defined for the type
[[nodiscard]] double measure_shape(ElementType type, const Vec3d* corners, ShapeMetric metric);

enum class ElementState : std::uint8_t { valid, degenerate, inverted };

/// Statistics over the faces of a volume mesh, as OpenFOAM's checkMesh reports them.
struct FaceStats {
  std::int64_t internal_face_count = 0;  // between two elements
  double max_non_orthogonality = 0;      // degrees
  double average_non_orthogonality = 0;  // degrees, of the mean cosine
  double max_skewness = 0;               // boundary faces included
};

/// Metrics of every element, in double.
struct ElementTable {
  std::vector<ElementMetric> metrics;
  /// [metrics.size()][element_count], in the mesh's order; NaN where an element does not have the
  /// metric.
  std::vector<std::vector<double>> columns;
  std::vector<ElementState> states;  // [element_count]
  std::optional<FaceStats> faces;    // with `non_orthogonality` or `skewness`, in volume meshes
};

/// Measures metrics and state of every element of a valid mesh. Multi-threaded, the same bits for
/// any number of threads. O(elements), with metrics of faces O(elements log elements) and 40 bytes
/// for each face of an element.
///
/// Metrics of faces are OpenFOAM's (primitiveMeshTools, version 1912): face centres and areas by
/// triangles about the mean of the nodes, cell centres by pyramids about the mean of the face
/// centres. A face that belongs to one element, or to more than two, counts as boundary.
[[nodiscard]] ElementTable tabulate_elements(const TopologyView& topology,
                                             const PositionsView& positions,
                                             const SurfaceOrientation& orientation,
                                             std::vector<ElementMetric> metrics);

}  // namespace meshsmooth
