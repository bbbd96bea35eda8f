#pragma once

#include <array>
#include <cstddef>

#include "mesh/wide.hpp"
#include "meshsmooth/element_geometry.hpp"

namespace meshsmooth::detail {

/// Writes the positions of four nodes, by coordinate, from column `t` on.
template <class Positions, class Node, int kSize>
[[gnu::always_inline]] inline void set_four(double (&columns)[3][kSize], int t,
                                            const Positions& positions, Node a, Node b, Node c,
                                            Node d) {
  const auto at = [&](Node node) {
    return vec3_cast<double>(positions[static_cast<std::size_t>(node)]);
  };
  const Vec3d p = at(a), q = at(b), r = at(c), s = at(d);
  store_four(&columns[0][t], p.x, q.x, r.x, s.x);
  store_four(&columns[1][t], p.y, q.y, r.y, s.y);
  store_four(&columns[2][t], p.z, q.z, r.z, s.z);
}

/// The corners of several tetrahedra, laid out for vectors: a formula of one tetrahedron evaluates
/// all at once, with the same bits.
class TetrahedronBatch {
 public:
  static constexpr int kSize = 8;
  /// Results of a formula: [which][tetrahedron].
  template <std::size_t kCount>
  using Results = std::array<std::array<double, kSize>, kCount>;

  /// `nodes_of(t)` are the four of tetrahedron `t`.
  template <class Positions, class NodesOf>
  [[gnu::always_inline]] inline void set_all(const Positions& positions, const NodesOf& nodes_of) {
    for (int t = 0; t < kSize; t += 4) {
      const auto* const a = nodes_of(t);
      const auto* const b = nodes_of(t + 1);
      const auto* const c = nodes_of(t + 2);
      const auto* const d = nodes_of(t + 3);
      for (int n = 0; n < 4; ++n) {
        set_four(corners_[n], t, positions, a[n], b[n], c[n], d[n]);
      }
    }
  }
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
    return evaluate_lanes<kCount>(
        [&](int, Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) { return formula(p0, p1, p2, p3); });
  }
  /// The same, of `formula(t, p0, p1, p2, p3)`.
  template <std::size_t kCount, class Formula>
  [[nodiscard, gnu::always_inline]] inline Results<kCount> evaluate_lanes(
      const Formula& formula) const {
    Results<kCount> results;
    for (int t = 0; t < kSize; ++t) {
      const std::array<double, kCount> values = formula(t, at(0, t), at(1, t), at(2, t), at(3, t));
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
