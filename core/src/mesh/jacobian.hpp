#pragma once

// Whether the Jacobian of an element is positive everywhere, for host and device.

#include "meshsmooth/element_geometry.hpp"

namespace meshsmooth::detail {

/// What is certain of a Jacobian's sign, rounding included.
enum class JacobianSign { positive, negative_somewhere, unknown };

/// The Jacobian of an element as a polynomial in the unit cube (square: kDepth 1) of degree 2 in
/// each variable, by its Bézier coefficients [p][q][r]: it lies in their convex hull, and those at
/// the corners are values of it. Every coefficient is linear in the position of each node.
///
/// Source: Johnen, Remacle, Geuzaine 2013, "Geometrical validity of curvilinear finite elements".
template <int kDepth>
struct JacobianPolynomial {
  static constexpr int kLast = kDepth - 1;  // of r
  double at[3][3][kDepth];
  double bound;  // of the rounding in a coefficient

  [[nodiscard]] MESHSMOOTH_HD JacobianSign sign() const {
    bool positive = true;
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        for (int r = 0; r < kDepth; ++r) {
          if (at[p][q][r] > bound) continue;
          positive = false;
          if (p % 2 == 0 && q % 2 == 0 && r % 2 == 0 && at[p][q][r] < -bound) {
            return JacobianSign::negative_somewhere;
          }
        }
      }
    }
    return positive ? JacobianSign::positive : JacobianSign::unknown;
  }

  /// The polynomial on one half of the cube, by de Casteljau's algorithm along an axis.
  [[nodiscard]] MESHSMOOTH_HD JacobianPolynomial half(int axis, bool upper) const {
    JacobianPolynomial result = *this;
    const int rows = axis == 2 ? 9 : 3 * kDepth;
    const int step = axis == 0 ? 3 * kDepth : axis == 1 ? kDepth : 1;
    for (int row = 0; row < rows; ++row) {
      const int first = axis == 0   ? row
                        : axis == 1 ? row / kDepth * 3 * kDepth + row % kDepth
                                    : row * kDepth;
      double* const b = &result.at[0][0][0] + first;
      const double low = (b[0] + b[step]) / 2, high = (b[step] + b[2 * step]) / 2;
      b[upper ? 0 : 2 * step] = (low + high) / 2;
      b[step] = upper ? high : low;
    }
    return result;
  }
};

/// The sign of a polynomial whose coefficients do not tell it, by those on parts of the cube, which
/// are halved along all axes up to `kLevels` times.
template <int kLevels, int kDepth>
MESHSMOOTH_HD JacobianSign subdivided_sign(const JacobianPolynomial<kDepth>& whole) {
  if constexpr (kLevels == 0) {
    return JacobianSign::unknown;
  } else {
    JacobianSign result = JacobianSign::positive;
    for (int part = 0; part < (kDepth == 1 ? 4 : 8); ++part) {
      JacobianPolynomial<kDepth> of_part = whole.half(0, (part & 1) != 0).half(1, (part & 2) != 0);
      if constexpr (kDepth > 1) of_part = of_part.half(2, (part & 4) != 0);
      JacobianSign sign = of_part.sign();
      if (sign == JacobianSign::unknown) sign = subdivided_sign<kLevels - 1>(of_part);
      if (sign == JacobianSign::negative_somewhere) return sign;
      if (sign == JacobianSign::unknown) result = sign;
    }
    return result;
  }
}
inline constexpr int kJacobianLevels = 5;

/// The edge vectors of a hexahedron by the nodes of its unit cube: along the first axis [j][k], the
/// second [i][k], the third [i][j].
struct HexahedronEdges {
  Vec3d a[2][2], b[2][2], c[2][2];

  template <class Get>
  MESHSMOOTH_HD explicit HexahedronEdges(const Get& get) {
    // VTK's node of (i, j, k).
    const auto node = [](int i, int j, int k) { return 4 * k + (j == 0 ? i : 3 - i); };
    for (int m = 0; m < 2; ++m) {
      for (int n = 0; n < 2; ++n) {
        a[m][n] = get(node(1, m, n)) - get(node(0, m, n));
        b[m][n] = get(node(m, 1, n)) - get(node(m, 0, n));
        c[m][n] = get(node(m, n, 1)) - get(node(m, n, 0));
      }
    }
  }

  /// A sufficient condition, for most elements: seen from the mean edges, each edge goes further in
  /// its own direction than in the two others, so all matrices of edges are diagonally dominant by
  /// columns.
  [[nodiscard]] MESHSMOOTH_HD bool dominant() const {
    const auto sum = [](const Vec3d(&e)[2][2]) {
      return (e[0][0] + e[0][1]) + (e[1][0] + e[1][1]);
    };
    const Vec3d sa = sum(a), sb = sum(b), sc = sum(c);
    const Vec3d na = cross(sb, sc), nb = cross(sc, sa), nc = cross(sa, sb);
    const double determinant = dot(sa, na);
    const double squares = dot(sa, sa) * dot(sb, sb) * dot(sc, sc);
    constexpr double kCertain = 1e-10;
    if (!(determinant > 0 && determinant * determinant > kCertain * kCertain * squares)) {
      return false;
    }
    const auto goes = [](const Vec3d(&e)[2][2], Vec3d own, Vec3d other, Vec3d third) {
      bool all = true;
      for (int m = 0; m < 2; ++m) {
        for (int n = 0; n < 2; ++n) {
          all = all && 0.999 * dot(e[m][n], own) >
                           std::abs(dot(e[m][n], other)) + std::abs(dot(e[m][n], third));
        }
      }
      return all;
    };
    return goes(a, na, nb, nc) && goes(b, nb, nc, na) && goes(c, nc, na, nb);
  }

  [[nodiscard]] MESHSMOOTH_HD JacobianPolynomial<3> jacobian() const {
    JacobianPolynomial<3> result{};
    const auto longest = [](const Vec3d(&e)[2][2]) {
      double squared = 0;
      for (int m = 0; m < 4; ++m) {
        const double own = dot(e[m / 2][m % 2], e[m / 2][m % 2]);
        squared = own > squared ? own : squared;
      }
      return squared;
    };
    result.bound = kSignBound * std::sqrt(longest(a) * longest(b) * longest(c));
    for (int n = 0; n < 16; ++n) {
      const int j = n & 1, k = n >> 1 & 1, i = n >> 2 & 1, l = n >> 3;
      const Vec3d normal = cross(a[j][k], b[i][l]);
      for (int m = 0; m < 4; ++m) {
        const int e = m & 1, f = m >> 1;
        result.at[i + e][j + f][k + l] += dot(normal, c[e][f]);
      }
    }
    for (int n = 0; n < 27; ++n) {
      const int ones = (n / 9 == 1 ? 1 : 0) + (n / 3 % 3 == 1 ? 1 : 0) + (n % 3 == 1 ? 1 : 0);
      result.at[n / 9][n / 3 % 3][n % 3] /= 1 << ones;
    }
    return result;
  }
};

/// Of a pyramid, divided by (1 - t)^2 at the height t: independent of it.
template <class Get>
MESHSMOOTH_HD JacobianPolynomial<1> pyramid_jacobian(const Get& get) {
  JacobianPolynomial<1> result{};
  const Vec3d a[] = {get(1) - get(0), get(2) - get(3)};
  const Vec3d b[] = {get(3) - get(0), get(2) - get(1)};
  const Vec3d c[2][2] = {{get(4) - get(0), get(4) - get(3)}, {get(4) - get(1), get(4) - get(2)}};
  double longest = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const Vec3d normal = cross(a[j], b[i]);
      for (int m = 0; m < 4; ++m) {
        const Vec3d up = c[m >> 1][m & 1];
        result.at[i + (m >> 1)][j + (m & 1)][0] += dot(normal, up);
        const double squared = dot(a[j], a[j]) * dot(b[i], b[i]) * dot(up, up);
        longest = squared > longest ? squared : longest;
      }
    }
  }
  for (int n = 0; n < 9; ++n) {
    const int ones = (n / 3 == 1 ? 1 : 0) + (n % 3 == 1 ? 1 : 0);
    result.at[n / 3][n % 3][0] /= 1 << ones;
  }
  result.bound = kSignBound * std::sqrt(longest);
  return result;
}

/// Of a wedge it is quadratic along the height and linear across: positive if it is so on the three
/// upright edges.
template <class Get>
MESHSMOOTH_HD JacobianSign wedge_jacobian_sign(const Get& get) {
  const Vec3d a[] = {get(2) - get(0), get(5) - get(3)};
  const Vec3d b[] = {get(1) - get(0), get(4) - get(3)};
  const Vec3d first = cross(a[0], b[0]), last = cross(a[1], b[1]);
  const Vec3d middle = 0.5 * (cross(a[0], b[1]) + cross(a[1], b[0]));
  const double longest_a = dot(a[0], a[0]) > dot(a[1], a[1]) ? dot(a[0], a[0]) : dot(a[1], a[1]);
  const double longest_b = dot(b[0], b[0]) > dot(b[1], b[1]) ? dot(b[0], b[0]) : dot(b[1], b[1]);
  JacobianSign result = JacobianSign::positive;
  for (int m = 0; m < 3; ++m) {
    const Vec3d up = get(m + 3) - get(m);
    const double bound = kSignBound * std::sqrt(longest_a * longest_b * dot(up, up));
    const double low = dot(first, up), mid = dot(middle, up), high = dot(last, up);
    if (low < -bound || high < -bound) return JacobianSign::negative_somewhere;
    if (!(low > bound && high > bound)) {
      result = JacobianSign::unknown;
      continue;
    }
    // The least value of the parabola has the sign of low high - mid^2 where mid < 0.
    if (mid > 0) continue;
    const double excess = low * high - mid * mid;
    const double uncertain = 2 * bound * (low + high - 2 * mid);
    if (excess < -uncertain) return JacobianSign::negative_somewhere;
    if (!(excess > uncertain)) result = JacobianSign::unknown;
  }
  return result;
}

/// The sign of a polynomial, subdivided if need be.
template <int kDepth>
MESHSMOOTH_OUTLINE MESHSMOOTH_HD JacobianSign sign_of(const JacobianPolynomial<kDepth>& jacobian) {
  const JacobianSign sign = jacobian.sign();
  return sign == JacobianSign::unknown ? subdivided_sign<kJacobianLevels>(jacobian) : sign;
}

MESHSMOOTH_OUTLINE MESHSMOOTH_HD inline JacobianSign sign_of(const HexahedronEdges& edges) {
  return edges.dominant() ? JacobianSign::positive : sign_of(edges.jacobian());
}

/// The sign of an element's Jacobian. In simplices, and in quadrilaterals, where it is bilinear,
/// the corners decide; they are not checked here: positive.
///
/// `get(n)` gives the position of local node n.
template <class Get>
MESHSMOOTH_HD JacobianSign jacobian_sign(const ElementShape& shape, const Get& get) {
  if (shape.dimension == 2 || shape.node_count == 4) return JacobianSign::positive;
  if (shape.node_count == 6) return wedge_jacobian_sign(get);
  if (shape.node_count == 5) return sign_of(pyramid_jacobian(get));
  return sign_of(HexahedronEdges(get));
}

}  // namespace meshsmooth::detail
