#pragma once

#include "meshsmooth/element_geometry.hpp"

namespace meshsmooth::detail {

/// The brief evaluation of several tetrahedra at once, vectorized, without roots and divisions
/// except that of the volume.
class TetrahedronBatch {
 public:
  static constexpr int kSize = 8;

  /// `nodes` are the four of tetrahedron `t`.
  template <class Real>
  void set(int t, const Vec3<Real>* positions, const NodeId* nodes) {
    for (int corner = 0; corner < 4; ++corner) {
      const Vec3<Real>& p = positions[nodes[corner]];
      corners_[corner][0][t] = static_cast<double>(p.x);
      corners_[corner][1][t] = static_cast<double>(p.y);
      corners_[corner][2][t] = static_cast<double>(p.z);
    }
  }
  /// Evaluates all that are set; the others have no meaning. `least_cube` is of a mean ratio. The
  /// same bits as `compute_plainly`, which runs on any processor.
  void compute(double least_cube) {
#if defined(__x86_64__)
    static const bool wide = __builtin_cpu_supports("avx2") != 0;
    if (wide) return compute_by_avx2(least_cube);
#endif
    compute_plainly(least_cube);
  }
  [[gnu::always_inline]] inline void compute_plainly(double least_cube) {
    for (int t = 0; t < kSize; ++t) {
      const Vec3d a = at(1, t) - at(0, t), b = at(2, t) - at(0, t), c = at(3, t) - at(0, t);
      const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
      const Vec3d ab = b - a, ac = c - a, bc = c - b;
      const double determinant = dot(a, cross(b, c));
      const double edges = aa + bb + cc + dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
      volume_[t] = determinant / 6;
      // Twice the bound: on this side of it rounding makes no difference.
      const bool positive = determinant > 0;
      const bool certain = determinant * determinant > 4 * kSignBound * kSignBound * (aa * bb * cc);
      const bool good = 432 * determinant * determinant > least_cube * (edges * edges * edges);
      clear_[t] = positive & certain & good ? 1 : 0;
    }
  }
  /// Neither inverted nor degenerate, and its mean ratio certainly above the least.
  [[nodiscard]] bool clear(int t) const { return clear_[t] != 0; }
  /// With the bits of `measure_tetrahedron`.
  [[nodiscard]] double volume(int t) const { return volume_[t]; }

 private:
#if defined(__x86_64__)
  [[gnu::target("avx2")]] void compute_by_avx2(double least_cube) { compute_plainly(least_cube); }
#endif

  [[nodiscard]] Vec3d at(int corner, int t) const {
    return {corners_[corner][0][t], corners_[corner][1][t], corners_[corner][2][t]};
  }

  double corners_[4][3][kSize]{};
  double volume_[kSize], clear_[kSize];  // all of one width, for the compiler
};

}  // namespace meshsmooth::detail
