#pragma once

#include <cmath>

#include "meshsmooth/element.hpp"
#include "meshsmooth/vec3.hpp"

namespace meshsmooth {

/// Below this share of the product of its edge lengths the sign of a corner's
/// determinant may be rounding.
inline constexpr double kSignBound = 1e-14;

/// What the quality measures of an element are computed from, at one corner; in the mesh's unit.
struct CornerGeometry {
  /// Of the edge vectors; in a surface element twice the area of the corner's triangle, negative
  /// if its normal points against the reference.
  double determinant;
  double length_product;  // of the corner's edges
  /// Squared Frobenius norm of the shape matrix: edge vectors times the inverse of the ideal ones.
  double shape_norm_squared;
  /// +1 or -1 if the sign of the determinant is certain in double, else 0.
  int sign;
};

/// Measures one corner of an element.
///
/// @param shape      the element's row of the table
/// @param k          the corner, 0 … shape.corner_count - 1
/// @param get        get(n): position of local node n, as Vec3d
/// @param reference  unit normal of a surface element, or zero to accept its own; unused for
///                   volume elements
template <class GetPosition>
MESHSMOOTH_HD CornerGeometry corner_geometry(const ElementShape& shape, int k,
                                             const GetPosition& get, Vec3d reference) {
  const CornerShape& corner = shape.corners[k];
  const auto& w = shape.ideal.inverse;
  const Vec3d origin = get(corner.node);
  const Vec3d a = get(corner.neighbours[0]) - origin;
  const Vec3d b = get(corner.neighbours[1]) - origin;
  CornerGeometry result{};
  double decisive = 0;  // the determinant whose sign counts
  if (shape.dimension == 2) {
    const Vec3d normal = cross(a, b);
    const double area = norm(normal);
    const bool referenced = dot(reference, reference) > 0;
    decisive = referenced ? dot(normal, reference) : area;
    result.determinant = decisive < 0 ? -area : area;
    result.length_product = std::sqrt(dot(a, a) * dot(b, b));
    const Vec3d s = w[0][0] * a + w[1][0] * b;
    const Vec3d t = w[0][1] * a + w[1][1] * b;
    result.shape_norm_squared = dot(s, s) + dot(t, t);
  } else {
    const Vec3d c = get(corner.neighbours[2]) - origin;
    decisive = dot(a, cross(b, c));
    result.determinant = decisive;
    result.length_product = std::sqrt(dot(a, a) * dot(b, b) * dot(c, c));
    for (int column = 0; column < 3; ++column) {
      const Vec3d t = w[0][column] * a + w[1][column] * b + w[2][column] * c;
      result.shape_norm_squared += dot(t, t);
    }
  }
  const double bound = kSignBound * result.length_product;
  result.sign = decisive > bound ? 1 : (decisive < -bound ? -1 : 0);
  return result;
}

/// Signed volume of a volume element; area of a surface element, negative if its normal points
/// against `reference`. A facet with four nodes is the bilinear patch, whose cone is the mean of
/// its two triangulations; a quad's area is that along its mean normal. Parameters as for
/// `corner_geometry`.
template <class GetPosition>
MESHSMOOTH_HD double element_volume(const ElementShape& shape, const GetPosition& get,
                                    Vec3d reference) {
  const Vec3d origin = get(0);
  if (shape.dimension == 2) {
    const Vec3d normal = shape.node_count == 3 ? cross(get(1) - origin, get(2) - origin)
                                               : cross(get(2) - origin, get(3) - get(1));
    const double area = norm(normal) / 2;
    return dot(normal, reference) < 0 ? -area : area;
  }
  if (shape.node_count == 4) {
    return dot(get(1) - origin, cross(get(2) - origin, get(3) - origin)) / 6;
  }
  double sixfold = 0;
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetShape& facet = shape.facets[f];
    const Vec3d a = get(facet.nodes[0]) - origin;
    const Vec3d b = get(facet.nodes[1]) - origin;
    const Vec3d c = get(facet.nodes[2]) - origin;
    if (facet.node_count == 3) {
      sixfold += dot(a, cross(b, c));
      continue;
    }
    const Vec3d d = get(facet.nodes[3]) - origin;
    sixfold +=
        (dot(a, cross(b, c)) + dot(a, cross(c, d)) + dot(a, cross(b, d)) + dot(b, cross(c, d))) / 2;
  }
  return sixfold / 6;
}

}  // namespace meshsmooth
