#pragma once

// The measures of one element, for host and device.

#include <cmath>

#include "mesh/cube_root.hpp"
#include "mesh/jacobian.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

// The cube root of a ratio, not of a volume: a mesh scaled by a power of two has the same bits.

MESHSMOOTH_HD inline double mean_ratio(const ElementShape& shape, const CornerGeometry& corner) {
  const double size = corner.shape_norm_squared;
  if (!(size > 0)) return 0;
  const double determinant = corner.determinant / shape.ideal.determinant;
  if (shape.dimension == 2) return 2 * determinant / size;
  const double ratio = cube_root(27 * determinant * determinant / (size * size * size));
  return determinant < 0 ? -ratio : ratio;
}

MESHSMOOTH_HD inline double scaled_jacobian(const ElementShape& shape,
                                            const CornerGeometry& corner) {
  if (!(corner.length_product > 0)) return 0;
  return corner.determinant / (corner.length_product * shape.ideal.determinant);
}

MESHSMOOTH_HD inline void measure_triangle_angles(const Vec3d* p, ElementMeasure& measure) {
  measure.min_angle_cos = -1;
  measure.max_angle_cos = 1;
  for (int n = 0; n < 3; ++n) {
    const Vec3d a = p[(n + 1) % 3] - p[n], b = p[(n + 2) % 3] - p[n];
    const double lengths = std::sqrt(dot(a, a) * dot(b, b));
    const double cosine = dot(a, b) / lengths;
    if (!(lengths > 0) || measure.inverted) {
      measure.min_angle_cos = 1;
      measure.max_angle_cos = -1;
      return;
    }
    if (cosine > measure.min_angle_cos) measure.min_angle_cos = cosine < 1 ? cosine : 1;
    if (cosine < measure.max_angle_cos) measure.max_angle_cos = cosine > -1 ? cosine : -1;
  }
}

MESHSMOOTH_HD inline ElementMeasure measure_by_corners(const ElementShape& shape, const Vec3d* p,
                                                       Vec3d reference) {
  const auto get = [p](int n) { return p[n]; };
  ElementMeasure measure;
  bool certain = true;
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerGeometry corner = corner_geometry(shape, k, get, reference);
    const double ratio = mean_ratio(shape, corner);
    const double jacobian = scaled_jacobian(shape, corner);
    if (k == 0 || ratio < measure.mean_ratio) measure.mean_ratio = ratio;
    if (k == 0 || jacobian < measure.scaled_jacobian) measure.scaled_jacobian = jacobian;
    measure.inverted |= corner.sign < 0;
    certain &= corner.sign > 0;
  }
  if (certain) {
    const JacobianSign sign = jacobian_sign(shape, get);
    measure.inverted = sign == JacobianSign::negative_somewhere;
    certain = sign == JacobianSign::positive;
  }
  measure.degenerate = !certain && !measure.inverted;
  measure.volume = element_volume(shape, get, reference);
  if (shape.dimension == 2 && shape.node_count == 3) measure_triangle_angles(p, measure);
  return measure;
}

/// The same as by corners, but what the corners share is computed once: no branches and no calls,
/// so that a compiler vectorizes it.
MESHSMOOTH_HD inline ElementMeasure measure_tetrahedron(Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
  const auto lower = [](double x, double y) { return x < y ? x : y; };
  const auto higher = [](double x, double y) { return x > y ? x : y; };
  // 0 where a measure is not defined: some length, area or volume is 0.
  const auto quotient = [](double x, double y) { return y > 0 ? x / y : 0.0; };

  const Vec3d a = p1 - p0, b = p2 - p0, c = p3 - p0;
  const Vec3d ab = b - a, ac = c - a, bc = c - b;
  const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
  const double abab = dot(ab, ab), acac = dot(ac, ac), bcbc = dot(bc, bc);

  // Inward face normals; n0 lies opposite to node 0.
  const Vec3d n1 = cross(b, c), n2 = cross(c, a), n3 = cross(a, b), n0 = cross(ac, ab);
  const double s0 = dot(n0, n0), s1 = dot(n1, n1), s2 = dot(n2, n2), s3 = dot(n3, n3);
  const double i0 = quotient(1, std::sqrt(s0)), i1 = quotient(1, std::sqrt(s1)),
               i2 = quotient(1, std::sqrt(s2)), i3 = quotient(1, std::sqrt(s3));

  ElementMeasure m;
  const double determinant = dot(a, n1);
  const double bound = kSignBound * std::sqrt(aa * bb * cc);
  m.volume = determinant / 6;
  m.inverted = determinant < -bound;
  m.degenerate = !m.inverted && !(determinant > bound);

  // 27 det(T)^2 / |T|^6 = 432 det^2 / (sum l^2)^3 at every corner.
  const double edges = aa + bb + cc + abab + acac + bcbc;
  const double ratio = cube_root(quotient(432 * determinant * determinant, edges * edges * edges));
  m.mean_ratio = determinant < 0 ? -ratio : ratio;

  // The corner with the longest edges, as in Verdict.
  const double longest =
      higher(higher(aa * bb * cc, aa * abab * acac), higher(bb * abab * bcbc, cc * acac * bcbc));
  m.scaled_jacobian = quotient(1.4142135623730950488 * determinant, std::sqrt(longest));

  // 3 r / R with r = |det| / sum |n| and R = |circum| / (2 |det|).
  const Vec3d circum = aa * n1 + bb * n2 + cc * n3;
  const double normals = s0 * i0 + s1 * i1 + s2 * i2 + s3 * i3;
  m.radius_ratio =
      quotient(6 * determinant * std::abs(determinant), normals * std::sqrt(dot(circum, circum)));

  const double c01 = -dot(n0, n1) * (i0 * i1), c02 = -dot(n0, n2) * (i0 * i2),
               c03 = -dot(n0, n3) * (i0 * i3), c12 = -dot(n1, n2) * (i1 * i2),
               c13 = -dot(n1, n3) * (i1 * i3), c23 = -dot(n2, n3) * (i2 * i3);
  const double greatest = higher(higher(higher(c01, c02), higher(c03, c12)), higher(c13, c23));
  const double least = lower(lower(lower(c01, c02), lower(c03, c12)), lower(c13, c23));
  const bool defined = lower(lower(s0, s1), lower(s2, s3)) > 0 && !m.inverted;
  m.min_angle_cos = defined ? lower(greatest, 1.0) : 1.0;
  m.max_angle_cos = defined ? higher(least, -1.0) : -1.0;
  return m;
}

MESHSMOOTH_HD inline ElementMeasure measure_tetrahedron(const Vec3d* p) {
  return measure_tetrahedron(p[0], p[1], p[2], p[3]);
}

/// `corners` are the positions of the element's nodes in VTK order.
MESHSMOOTH_HD inline ElementMeasure measure_element(const ElementShape& shape, const Vec3d* corners,
                                                    Vec3d reference) {
  return shape.dimension == 3 && shape.node_count == 4
             ? measure_tetrahedron(corners)
             : measure_by_corners(shape, corners, reference);
}

}  // namespace meshsmooth::detail
