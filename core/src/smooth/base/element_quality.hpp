#pragma once

#include "mesh/jacobian.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// `element_quality` of a tetrahedron.
MESHSMOOTH_HD inline double tetrahedron_quality(Vec3d origin, Vec3d p1, Vec3d p2, Vec3d p3) {
  const Vec3d a = p1 - origin, b = p2 - origin, c = p3 - origin;
  const double det = dot(a, cross(b, c));
  const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
  const Vec3d ab = b - a, ac = c - a, bc = c - b;
  const double length = aa + bb + cc + dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
  if (!(det * det > kSignBound * kSignBound * (aa * bb * cc))) return 0.0;
  const double mean_ratio = 432.0 * (det * det) / (length * length * length);
  return det > 0 ? mean_ratio : -mean_ratio;
}

/// Whether `tetrahedron_quality` is above 0, without the lengths of all edges.
MESHSMOOTH_HD inline bool tetrahedron_is_positive(Vec3d origin, Vec3d p1, Vec3d p2, Vec3d p3) {
  const Vec3d a = p1 - origin, b = p2 - origin, c = p3 - origin;
  const double det = dot(a, cross(b, c));
  return det > 0 && det * det > kSignBound * kSignBound * (dot(a, a) * dot(b, b) * dot(c, c));
}

/// The quality by which the rules compare elements: above 0 if and only if the Jacobian is
/// certainly positive everywhere, negative if it is certainly negative at a corner, else 0. In a
/// volume element it is the cube of the worst corner's mean ratio (the same order without a root),
/// in a surface element the mean ratio itself.
///
/// `get(n)` gives the position of local node n in double; `reference` is the
/// normal that a surface element must not turn against. Code for tetrahedra alone needs few
/// registers of a device.
template <bool kTetrahedra = false, class Get>
MESHSMOOTH_HD double element_quality(const ElementShape& shape, const Get& get, Vec3d reference) {
  if (kTetrahedra || (shape.dimension == 3 && shape.node_count == 4)) {
    return tetrahedron_quality(get(0), get(1), get(2), get(3));
  }
  double worst = 2.0;
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerGeometry corner = corner_geometry(shape, k, get, reference);
    const double det = corner.determinant / shape.ideal.determinant;
    const double size = corner.shape_norm_squared;
    double mean_ratio = 0;
    if (corner.sign != 0) {
      mean_ratio = shape.dimension == 2 ? 2.0 * det / size
                                        : corner.sign * 27.0 * det * det / (size * size * size);
    }
    if (!(mean_ratio >= worst)) worst = mean_ratio;
  }
  return worst > 0 && jacobian_sign(shape, get) != JacobianSign::positive ? 0 : worst;
}

/// Volume (area of a surface element) without sign and the mean of its nodes.
struct ElementMass {
  double volume;
  Vec3d centre;
};

template <class Get>
MESHSMOOTH_HD ElementMass element_mass(const ElementShape& shape, const Get& get) {
  Vec3d centre{0, 0, 0};
  for (int n = 0; n < shape.node_count; ++n) centre += get(n);
  centre = (1.0 / shape.node_count) * centre;
  return {std::abs(element_volume(shape, get, {0, 0, 0})), centre};
}

}  // namespace meshsmooth::detail
