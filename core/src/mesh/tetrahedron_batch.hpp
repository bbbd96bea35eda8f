#pragma once

#include <array>
#include <cstddef>

#include "mesh/wide.hpp"
#include "meshsmooth/element_geometry.hpp"

namespace meshsmooth::detail {

/// The corners of several tetrahedra, laid out for vectors: a formula of one tetrahedron evaluates
/// all at once, with the same bits.
class TetrahedronBatch {
 public:
  static constexpr int kSize = 8;
  /// Results of a formula: [which][tetrahedron].
  template <std::size_t kCount>
  using Results = std::array<std::array<double, kSize>, kCount>;

  /// `nodes` are the four of tetrahedron `t`.
  template <class Positions, class Node>
  void set(int t, const Positions& positions, const Node* nodes) {
    for (int corner = 0; corner < 4; ++corner) {
      set_corner(t, corner, positions[static_cast<std::size_t>(nodes[corner])]);
    }
  }
  template <class Real>
  void set_corner(int t, int corner, const Vec3<Real>& p) {
    corners_[corner][0][t] = static_cast<double>(p.x);
    corners_[corner][1][t] = static_cast<double>(p.y);
    corners_[corner][2][t] = static_cast<double>(p.z);
  }

  /// `formula(p0, p1, p2, p3)`, an array of `kCount` numbers, of all that are set; the other
  /// results have no meaning. To be called inside `run_wide`; the formula must have no branches
  /// that a compiler cannot replace by selections.
  template <std::size_t kCount, class Formula>
  [[nodiscard, gnu::always_inline]] inline Results<kCount> evaluate(const Formula& formula) const {
    Results<kCount> results;
    for (int t = 0; t < kSize; ++t) {
      const std::array<double, kCount> values = formula(at(0, t), at(1, t), at(2, t), at(3, t));
      for (std::size_t n = 0; n < kCount; ++n) results[n][t] = values[n];
    }
    return results;
  }

 private:
  [[nodiscard]] Vec3d at(int corner, int t) const {
    return {corners_[corner][0][t], corners_[corner][1][t], corners_[corner][2][t]};
  }

  double corners_[4][3][kSize];
};

}  // namespace meshsmooth::detail
