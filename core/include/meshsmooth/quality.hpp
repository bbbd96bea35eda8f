#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth {

/// How much is said of the elements of a mesh.
enum class QualityDetail {
  full,   // every metric of every element
  brief,  // what is inverted and degenerate, the volumes, the worst elements: a third of the time
};

enum class QualityMetric {
  mean_ratio,          // every type, worst corner; 1 = ideal, negative = inverted
  scaled_jacobian,     // every type, worst corner, ideal corner = 1; a pyramid may exceed 1
  radius_ratio,        // tetrahedra: 3 inradius / circumradius, signed
  min_dihedral_angle,  // tetrahedra, degrees; 0 when inverted
  max_dihedral_angle,  // tetrahedra, degrees; 180 when inverted
  min_angle,           // triangles, degrees; 0 when inverted
  max_angle,           // triangles, degrees; 180 when inverted
};

[[nodiscard]] std::string_view metric_name(QualityMetric metric);

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
  std::vector<std::int64_t> histogram;  // 32 equal bins; the outer ones take what lies outside
};

struct ElementQuality {
  std::int64_t element = -1;  // the caller's id
  ElementType type = ElementType::tetrahedron;
  double mean_ratio = 0;
  double scaled_jacobian = 0;
};

struct QualityStats {
  std::int64_t element_count = 0;
  /// Elements with a corner determinant that is certainly negative.
  std::int64_t inverted_count = 0;
  /// Not inverted, but the sign of a corner is not decidable in double.
  std::int64_t degenerate_count = 0;
  double sum_absolute_volume = 0;  // area for surface elements
  /// What the boundary facets enclose, by the divergence theorem: the sum of the
  /// signed volumes, in which each facet between two elements cancels. Differs from
  /// the sum above where elements overlap, inverted ones twice. 0 for surfaces.
  double enclosed_volume = 0;
  std::vector<MetricStats> metrics;
  std::vector<ElementQuality> worst;  // by mean ratio, then id; worst first; at most 10
};

/// Elements whose nodes are all fixed.
struct LockedStats {
  std::int64_t element_count = 0;
  std::int64_t inverted_count = 0;
  std::optional<ElementQuality> worst;
};

/// What one element is energy. All measures in double from the stored
/// coordinates.
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

/// A direction to about half a degree, as multiples of 1/127. Enough to say on
/// which side of a surface a normal points, at 3 B.
using PackedDirection = Vec3<std::int8_t>;

[[nodiscard]] MESHSMOOTH_HD inline PackedDirection pack_direction(Vec3d unit) {
  const auto pack = [](double c) {
    return static_cast<std::int8_t>(c * 127 + (c < 0 ? -0.5 : 0.5));
  };
  return {pack(unit.x), pack(unit.y), pack(unit.z)};
}
[[nodiscard]] MESHSMOOTH_HD inline Vec3d unpack_direction(PackedDirection packed) {
  return (1.0 / 127) * vec3_cast<double>(packed);
}

/// Reference directions by which surface elements are judged: an element is
/// inverted when its normal points against its reference. For plane meshes (to
/// 1e-12 of their extent and to the rounding of the coordinates) the plane's
/// normal, on the side that gives a positive sum of areas; on curved surfaces
/// each element's own normal in the mesh given here; empty for volume meshes.
/// O(elements).
class SurfaceOrientation {
 public:
  SurfaceOrientation() = default;
  SurfaceOrientation(const TopologyView& topology, const PositionsView& positions);
  [[nodiscard]] bool plane() const { return plane_; }
  /// Normal for a global element id; zero vector for volume meshes.
  [[nodiscard]] Vec3d reference(std::size_t element) const {
    return normals_.empty() ? common_ : unpack_direction(normals_[element]);
  }
  /// A normal per element on curved surfaces; empty: all have `common()`.
  [[nodiscard]] std::span<const PackedDirection> normals() const { return normals_; }
  [[nodiscard]] Vec3d common() const { return common_; }

 private:
  bool plane_ = false;
  Vec3d common_{0, 0, 0};
  std::vector<PackedDirection> normals_;
};

/// Measures one element. `corners` are the positions of its nodes in VTK order,
/// `reference` the unit reference normal of a surface element; zero takes it as
/// it lies.
[[nodiscard]] ElementMeasure measure_element(ElementType type, const Vec3d* corners,
                                             Vec3d reference);

/// Judges every element in double, at all its corners. Needs a valid mesh.
/// `element_ids` are the names of the elements where these are not their places;
/// by name the worst are listed. Multi-threaded; same bits for every number of
/// threads. In brief there are no metrics. O(elements).
[[nodiscard]] QualityStats measure_quality(const TopologyView& topology,
                                           const PositionsView& positions,
                                           const SurfaceOrientation& orientation,
                                           std::span<const std::uint32_t> element_ids = {},
                                           QualityDetail quality_detail = QualityDetail::full);

/// Convenience over a mesh's own orientation.
[[nodiscard]] QualityStats measure_quality(const Mesh& mesh);

/// Counts the elements whose nodes are all fixed in `fixed` (one byte a node).
[[nodiscard]] LockedStats measure_locked(const TopologyView& topology,
                                         std::span<const std::uint8_t> fixed,
                                         const PositionsView& positions,
                                         const SurfaceOrientation& orientation,
                                         std::span<const std::uint32_t> element_ids = {});

}  // namespace meshsmooth
