#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "meshsmooth/enums.hpp"
#include "meshsmooth/mesh.hpp"

namespace meshsmooth {

inline constexpr auto kQualityMetrics = enum_values<QualityMetric>();

/// @returns the metric's name as in the enum.
[[nodiscard]] std::string_view metric_name(QualityMetric metric);
/// @returns the metric of that name; nothing for an unknown name
[[nodiscard]] std::optional<QualityMetric> find_metric(std::string_view name);
/// @returns whether the metric is defined for elements of the type
[[nodiscard]] bool has_metric(ElementType type, QualityMetric metric);

/// A metric over all elements it is defined for.
struct MetricStats {
  QualityMetric metric;
  std::int64_t element_count = 0;
  double min = 0;
  /// At most 1 % of the elements lie below; the lower edge of one of 2048 bins.
  double percentile_1 = 0;
  double mean = 0;
  double max = 0;
  double histogram_lower = 0;
  double histogram_upper = 0;
  std::vector<std::int64_t> histogram;  // 32 equal bins; the outer ones include values outside
};

/// One element and its main metrics.
struct ElementQuality {
  std::int64_t element = -1;  // the caller's id
  ElementType type = ElementType::tetrahedron;
  double mean_ratio = 0;
  double scaled_jacobian = 0;
};

/// The quality of a mesh.
struct QualityStats {
  std::int64_t element_count = 0;
  /// Elements whose Jacobian is certainly negative somewhere: at a corner, or between.
  std::int64_t inverted_count = 0;
  /// Not inverted, but the Jacobian is not certainly positive everywhere: its sign at a corner
  /// cannot be decided in double, or that between corners not by subdividing the element five
  /// times.
  std::int64_t degenerate_count = 0;
  double sum_absolute_volume = 0;  // area for surface elements
  /// Volume enclosed by the boundary facets, by the divergence theorem: the sum of the signed
  /// volumes, in which facets between elements cancel. Differs from the sum above where elements
  /// overlap. 0 for surfaces.
  double enclosed_volume = 0;
  std::vector<MetricStats> metrics;
  std::vector<ElementQuality> worst;  // by mean ratio, then id; worst first; at most 10
  /// Elements whose nodes are numbered the other way round than those of their neighbours (see
  /// numbering.hpp). They are evaluated as if they were numbered like them, so they are not
  /// inverted for that.
  std::int64_t mirrored_count = 0;
  std::vector<std::int64_t> mirrored;  // the first ids, at most `kMostListedMirrored`
  /// Elements that repeat nodes, evaluated as the type that they form.
  std::int64_t collapsed_count = 0;
  /// Elements without thickness, whose opposite facets coincide: evaluated nowhere, and not in
  /// `element_count`; their nodes stay. See canonical_topology.hpp.
  std::int64_t interface_count = 0;
};
inline constexpr std::size_t kMostListedMirrored = 10;

/// Some metrics of every element.
struct ElementQualityArrays {
  std::vector<QualityMetric> metrics;
  /// [metrics.size()][element_count], by the caller's ids; NaN where a metric is not defined for
  /// the type of the element.
  std::vector<float> values;

  /// @returns the values of `metrics[index]`, [element_count]
  [[nodiscard]] std::span<const float> of(std::size_t index) const {
    const std::size_t element_count = values.size() / metrics.size();
    return std::span(values).subspan(index * element_count, element_count);
  }
};

/// Elements whose nodes are all fixed.
struct LockedStats {
  std::int64_t element_count = 0;
  std::int64_t inverted_count = 0;
  std::optional<ElementQuality> worst;
};

/// The measures of one element, in double from the stored coordinates.
struct ElementMeasure {
  double mean_ratio = 0;
  double scaled_jacobian = 0;
  double volume = 0;  // signed; area for surface elements
  bool inverted = false;
  bool degenerate = false;
  double radius_ratio = 0;   // tetrahedra
  double min_angle_cos = 0;  // cosine of the least (dihedral) angle: tetrahedra and triangles
  double max_angle_cos = 0;
};

/// A direction to about half a degree, in multiples of 1/127: enough to tell on which side of a
/// surface a normal points, in 3 B.
using PackedDirection = Vec3<std::int8_t>;

/// Rounds a unit vector.
[[nodiscard]] MESHSMOOTH_HD inline PackedDirection pack_direction(Vec3d unit) {
  const auto pack = [](double c) {
    return static_cast<std::int8_t>(c * 127 + (c < 0 ? -0.5 : 0.5));
  };
  return {pack(unit.x), pack(unit.y), pack(unit.z)};
}
[[nodiscard]] MESHSMOOTH_HD inline Vec3d unpack_direction(PackedDirection packed) {
  return (1.0 / 127) * vec3_cast<double>(packed);
}

/// Reference directions of surface elements: an element is inverted if its normal points against
/// its reference. Of plane meshes (to 1e-12 of their extent and the rounding of the coordinates)
/// the plane's normal, on the side that gives a positive sum of areas; on curved surfaces each
/// element's normal in the mesh given here; empty for volume meshes. O(elements).
class SurfaceOrientation {
 public:
  SurfaceOrientation() = default;
  SurfaceOrientation(const TopologyView& topology, const PositionsView& positions);
  [[nodiscard]] bool plane() const { return plane_; }
  /// @returns the normal of an element by its id; zero for volume meshes
  [[nodiscard]] Vec3d reference(std::size_t element) const {
    return normals_.empty() ? common_ : unpack_direction(normals_[element]);
  }
  /// @returns a normal per element on curved surfaces; empty: all have `common()`
  [[nodiscard]] std::span<const PackedDirection> normals() const { return normals_; }
  [[nodiscard]] Vec3d common() const { return common_; }

 private:
  bool plane_ = false;
  Vec3d common_{0, 0, 0};
  std::vector<PackedDirection> normals_;
};

/// Measures one element.
///
/// @param nodes      positions of its nodes in VTK's order. Of a type of second order the measures
///                   are those of its corners, and it is inverted or degenerate by all of it
/// @param reference  unit reference normal of a surface element; zero accepts its own
[[nodiscard]] ElementMeasure measure_element(ElementType type, const Vec3d* nodes, Vec3d reference);

/// Evaluates every element of a valid mesh in double, at all its corners. O(elements),
/// multi-threaded; the same bits for every number of threads.
///
/// @param orientation     reference directions of surface elements
/// @param element_ids     ids under which the worst elements are listed; empty: their indices
/// @param quality_detail  `brief` leaves the metrics out
[[nodiscard]] QualityStats measure_quality(const TopologyView& topology,
                                           const PositionsView& positions,
                                           const SurfaceOrientation& orientation,
                                           std::span<const std::uint32_t> element_ids = {},
                                           QualityDetail quality_detail = QualityDetail::full);

/// Evaluates the `CanonicalTopology` of a mesh with its own orientation.
[[nodiscard]] QualityStats measure_quality(const Mesh& mesh);

/// Measures some metrics of every element of a valid mesh: the values that `measure_quality`
/// summarizes, rounded to float. O(elements), multi-threaded.
///
/// @param metrics      which, each once
/// @param element_ids  ids by which the values are stored, a permutation; empty: the indices
[[nodiscard]] ElementQualityArrays measure_elements(
    const TopologyView& topology, const PositionsView& positions,
    const SurfaceOrientation& orientation, std::vector<QualityMetric> metrics,
    std::span<const std::uint32_t> element_ids = {});

/// Counts the elements whose nodes are all fixed. Parameters as for `measure_quality`.
///
/// @param fixed  [node_count], non-zero = fixed
[[nodiscard]] LockedStats measure_locked(const TopologyView& topology,
                                         std::span<const std::uint8_t> fixed,
                                         const PositionsView& positions,
                                         const SurfaceOrientation& orientation,
                                         std::span<const std::uint32_t> element_ids = {});

}  // namespace meshsmooth
