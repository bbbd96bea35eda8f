#pragma once

#include <cmath>

#include "meshsmooth/element_geometry.hpp"

namespace meshsmooth::detail {

/// The measures of a tetrahedron short of the roots and arcs that do not
/// vectorise.
struct TetrahedronMeasure {
  double determinant;  // six times the signed volume
  double sign;         // of the determinant, 0 where it is not certain
  double edge_sum;     // of the squared edge lengths
  double scaled_jacobian;
  double radius_ratio;
  double min_angle_cos;  // cosine of the least dihedral angle
  double max_angle_cos;
};

/// Straight-line code without a call or a branch, so that a loop over it
/// vectorises.
[[nodiscard]] inline TetrahedronMeasure measure_tetrahedron(Vec3d p0, Vec3d p1, Vec3d p2,
                                                            Vec3d p3) {
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

  TetrahedronMeasure m;
  m.determinant = dot(a, n1);
  const double volume = m.determinant < 0 ? -m.determinant : m.determinant;
  const double bound = kSignBound * std::sqrt(aa * bb * cc);
  m.sign = volume > bound ? (m.determinant > 0 ? 1.0 : -1.0) : 0.0;
  m.edge_sum = aa + bb + cc + abab + acac + bcbc;

  const double longest =
      higher(higher(aa * bb * cc, aa * abab * acac), higher(bb * abab * bcbc, cc * acac * bcbc));
  constexpr double kRoot2 = 1.41421356237309504880;
  m.scaled_jacobian = quotient(kRoot2 * m.determinant, std::sqrt(longest));

  // 3 r / R with r = |det| / sum |n| and R = |circum| / (2 |det|).
  const Vec3d circum = aa * n1 + bb * n2 + cc * n3;
  const double normals = s0 * i0 + s1 * i1 + s2 * i2 + s3 * i3;
  m.radius_ratio = quotient(6 * m.determinant * volume, normals * std::sqrt(dot(circum, circum)));

  const double c01 = -dot(n0, n1) * (i0 * i1), c02 = -dot(n0, n2) * (i0 * i2),
               c03 = -dot(n0, n3) * (i0 * i3), c12 = -dot(n1, n2) * (i1 * i2),
               c13 = -dot(n1, n3) * (i1 * i3), c23 = -dot(n2, n3) * (i2 * i3);
  const double greatest = higher(higher(higher(c01, c02), higher(c03, c12)), higher(c13, c23));
  const double least = lower(lower(lower(c01, c02), lower(c03, c12)), lower(c13, c23));
  const bool judged = lower(lower(s0, s1), lower(s2, s3)) > 0 && !(m.sign < 0);
  m.min_angle_cos = judged ? lower(greatest, 1.0) : 1.0;
  m.max_angle_cos = judged ? higher(least, -1.0) : -1.0;
  return m;
}

/// Mean ratio by 6 (root2 det)^(2/3) / sum l^2, which is 3 |det T|^(2/3) /
/// |T|^2 at every corner; negative where the determinant is.
[[nodiscard]] inline double mean_ratio(double determinant, double edge_sum) {
  if (!(edge_sum > 0)) return 0;
  const double ratio = 6 * std::cbrt(2 * determinant * determinant) / edge_sum;
  return determinant < 0 ? -ratio : ratio;
}

}  // namespace meshsmooth::detail
