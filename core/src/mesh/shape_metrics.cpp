// Metrics of one element by the definitions of Verdict.

#include "meshsmooth/shape_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace meshsmooth {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool has_shape_metric(ElementType of, ShapeMetric metric) {
  const ElementType type = linear_type(of);
  switch (metric) {
    case ShapeMetric::aspect_ratio:
      return type == ElementType::triangle || type == ElementType::quad ||
             type == ElementType::tetrahedron;
    case ShapeMetric::condition_number:
      return type != ElementType::pyramid;
    case ShapeMetric::edge_ratio:
    case ShapeMetric::equiangle_skew:
      return true;
    case ShapeMetric::non_orthogonality:
    case ShapeMetric::skewness:
      return element_shape(type).dimension == 3;
  }
  return false;
}

double quotient(double x, double y) { return y > 0 ? x / y : kInfinity; }

double length_squared(Vec3d a) { return dot(a, a); }

struct EdgeLengths {
  double longest = 0, shortest = kInfinity, sum = 0;
};

EdgeLengths edge_lengths(const ElementShape& shape, const Vec3d* p) {
  EdgeLengths lengths;
  for (int e = 0; e < shape.edge_count; ++e) {
    const double length = norm(p[shape.edges[e][1]] - p[shape.edges[e][0]]);
    lengths.longest = std::max(lengths.longest, length);
    lengths.shortest = std::min(lengths.shortest, length);
    lengths.sum += length;
  }
  return lengths;
}

/// Triangle: L_max sum(L) / (4 sqrt(3) A). Quad: L_max sum(L) / (4 A), A = that of its triangles at
/// the nodes 1 and 3. Tetrahedron: L_max S / (6 sqrt(6) V), S = its surface: all three are L_max
/// over the inradius, normalized.
double aspect_ratio(const ElementShape& shape, const Vec3d* p) {
  const EdgeLengths edges = edge_lengths(shape, p);
  const Vec3d a = p[1] - p[0], b = p[2] - p[0];
  if (shape.node_count == 3) {
    return quotient(edges.longest * edges.sum, 2 * std::sqrt(3.0) * norm(cross(a, b)));
  }
  if (shape.dimension == 2) {
    const double areas =
        norm(cross(p[1] - p[0], p[2] - p[1])) + norm(cross(p[3] - p[2], p[0] - p[3]));
    return quotient(edges.longest * edges.sum, 2 * areas);
  }
  const Vec3d c = p[3] - p[0];
  const double areas = norm(cross(a, b)) + norm(cross(b, c)) + norm(cross(c, a)) +
                       norm(cross(p[2] - p[1], p[3] - p[1]));
  return quotient(edges.longest * areas, 2 * std::sqrt(6.0) * std::abs(dot(a, cross(b, c))));
}

/// In degrees, [0, 180]; by the arc tangent, which is exact where the arc cosine is not.
double angle_between(Vec3d a, Vec3d b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * (180 / 3.14159265358979323846);
}

/// Twice the signed areas of the corners of a quad, along its mean normal.
std::array<double, 4> corner_areas(const std::array<Vec3d, 4>& p) {
  const Vec3d normal = cross(p[2] - p[0], p[3] - p[1]);
  const double length = norm(normal);
  std::array<double, 4> areas{};
  for (std::size_t n = 0; length > 0 && n < 4; ++n) {
    const Vec3d edges = cross(p[(n + 1) % 4] - p[n], p[(n + 3) % 4] - p[n]);
    areas[n] = dot(edges, normal) / length;
  }
  return areas;
}

/// Of angles in degrees.
double skew(double least, double largest, double ideal) {
  return std::max((largest - ideal) / (180 - ideal), (ideal - least) / ideal);
}

/// Of the angles between the faces of a tetrahedron.
double dihedral_skew(const Vec3d* p) {
  const Vec3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  const std::array<Vec3d, 4> normals = {cross(c - a, b - a), cross(b, c), cross(c, a), cross(a, b)};
  double least = 180, largest = 0;
  for (std::size_t n = 0; n < 4; ++n) {
    for (std::size_t m = 0; m < n; ++m) {
      const double angle = 180 - angle_between(normals[n], normals[m]);
      least = std::min(least, angle);
      largest = std::max(largest, angle);
    }
  }
  return skew(least, largest, std::acos(1.0 / 3) * (180 / 3.14159265358979323846));
}

/// Of the angles of one face; in a folded quad the largest counts as 360 degrees minus it.
double face_skew(const std::array<Vec3d, 4>& p, std::size_t count) {
  double least = 360, largest = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const double angle =
        angle_between(p[(n + 1) % count] - p[n], p[(n + count - 1) % count] - p[n]);
    least = std::min(least, angle);
    largest = std::max(largest, angle);
  }
  if (count == 4 && std::ranges::any_of(corner_areas(p), [](double area) { return area < 0; })) {
    largest = 360 - largest;
  }
  return skew(least, largest, count == 3 ? 60 : 90);
}

double equiangle_skew(const ElementShape& shape, const Vec3d* p) {
  if (shape.dimension == 2) {
    std::array<Vec3d, 4> own{};
    std::copy_n(p, shape.node_count, own.begin());
    return face_skew(own, static_cast<std::size_t>(shape.node_count));
  }
  double worst = shape.node_count == 4 ? dihedral_skew(p) : 0;
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetShape& facet = shape.facets[f];
    std::array<Vec3d, 4> own{};
    for (std::size_t n = 0; n < static_cast<std::size_t>(facet.node_count); ++n) {
      own[n] = p[facet.nodes[n]];
    }
    worst = std::max(worst, face_skew(own, static_cast<std::size_t>(facet.node_count)));
  }
  return worst;
}

/// |A| |A^-1| / 3 of the matrix with these columns, in the Frobenius norm.
double condition_of(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
  const double norm_squared = length_squared(a) + length_squared(b) + length_squared(c);
  const double adjugate_squared = length_squared(ab) + length_squared(bc) + length_squared(ca);
  return quotient(std::sqrt(norm_squared * adjugate_squared), 3 * dot(a, bc));
}

/// Frobenius aspect of the tetrahedron at the corner of a wedge, over that of the ideal corner.
double wedge_corner(Vec3d a, Vec3d b, Vec3d c) {
  const double shape = 1.5 * (length_squared(a) + length_squared(b) + length_squared(c)) -
                       (dot(a, b) + dot(b, c) + dot(c, a));
  const double size =
      std::cbrt(2.0) * std::cbrt(dot(a, cross(b, c))) * std::cbrt(dot(a, cross(b, c)));
  const double ideal = 4 / (3 * std::cbrt(1.5));
  return dot(a, cross(b, c)) > 0 ? std::max(quotient(shape, 3 * ideal * size), 1.0) : kInfinity;
}

/// Triangle and tetrahedron: of the edges against the ideal ones, equal at all corners. Quad and
/// hexahedron: of the edges at each corner, the largest. Wedge: the largest Frobenius aspect,
/// which Verdict calls its condition.
double condition_number(const ElementShape& shape, const Vec3d* p) {
  const Vec3d a = p[1] - p[0], b = p[2] - p[0];
  if (shape.node_count == 3) {
    return quotient(length_squared(a) + length_squared(b) - dot(a, b),
                    std::sqrt(3.0) * norm(cross(a, b)));
  }
  if (shape.dimension == 2) {
    const std::array<double, 4> areas = corner_areas({p[0], p[1], p[2], p[3]});
    double worst = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      const double edges =
          length_squared(p[(n + 1) % 4] - p[n]) + length_squared(p[(n + 3) % 4] - p[n]);
      worst = std::max(worst, quotient(edges, 2 * areas[n]));
    }
    return worst;
  }
  if (shape.node_count == 4) {
    const Vec3d c = p[3] - p[0];
    return condition_of(a, (1 / std::sqrt(3.0)) * (2 * b - a),
                        (1 / std::sqrt(6.0)) * (3 * c - b - a));
  }
  double worst = 0;
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerShape& corner = shape.corners[k];
    std::array<Vec3d, 3> edges{};
    for (std::size_t n = 0; n < 3; ++n) edges[n] = p[corner.neighbours[n]] - p[corner.node];
    const auto measure = shape.node_count == 6 ? wedge_corner : condition_of;
    worst = std::max(worst, measure(edges[0], edges[1], edges[2]));
  }
  return worst;
}

}  // namespace

std::string_view element_metric_name(ElementMetric metric) {
  return std::visit([](auto own) { return enum_name(own); }, metric);
}

std::vector<ElementMetric> element_metrics() {
  std::vector<ElementMetric> all(kQualityMetrics.begin(), kQualityMetrics.end());
  all.insert(all.end(), kShapeMetrics.begin(), kShapeMetrics.end());
  return all;
}

std::optional<ElementMetric> find_element_metric(std::string_view name) {
  const std::vector<ElementMetric> all = element_metrics();
  const auto found = std::ranges::find(all, name, element_metric_name);
  return found == all.end() ? std::nullopt : std::optional(*found);
}

bool has_element_metric(ElementType type, ElementMetric metric) {
  if (const auto* shape = std::get_if<ShapeMetric>(&metric)) return has_shape_metric(type, *shape);
  return has_metric(type, std::get<QualityMetric>(metric));
}

double measure_shape(ElementType type, const Vec3d* corners, ShapeMetric metric) {
  if (!has_shape_metric(type, metric)) return kNaN;
  const ElementShape& shape = element_shape(type);
  switch (metric) {
    case ShapeMetric::aspect_ratio:
      return aspect_ratio(shape, corners);
    case ShapeMetric::edge_ratio: {
      const EdgeLengths edges = edge_lengths(shape, corners);
      return quotient(edges.longest, edges.shortest);
    }
    case ShapeMetric::equiangle_skew:
      return equiangle_skew(shape, corners);
    case ShapeMetric::condition_number:
      return condition_number(shape, corners);
    case ShapeMetric::non_orthogonality:
    case ShapeMetric::skewness:
      break;  // need the neighbours
  }
  return kNaN;
}

}  // namespace meshsmooth
