#pragma once

#include <array>

#include "mesh/tetrahedron_batch.hpp"
#include "smooth/energy/ball_energy.hpp"

namespace meshsmooth::detail {

/// Vectors of a batch, by coordinate.
template <int kSize>
struct Vectors {
  double x[kSize], y[kSize], z[kSize];

  void set(int t, Vec3d v) { x[t] = v.x, y[t] = v.y, z[t] = v.z; }
  [[nodiscard]] Vec3d get(int t) const { return {x[t], y[t], z[t]}; }
};

/// Products of a batch, by entry.
template <int kSize>
struct Products {
  double xx[kSize], yy[kSize], zz[kSize], xy[kSize], xz[kSize], yz[kSize];

  void set(int t, const CornerDerivatives::Product& p) {
    xx[t] = p.xx, yy[t] = p.yy, zz[t] = p.zz, xy[t] = p.xy, xz[t] = p.xz, yz[t] = p.yz;
  }
  [[nodiscard]] CornerDerivatives::Product get(int t) const {
    return {xx[t], yy[t], zz[t], xy[t], xz[t], yz[t]};
  }
};

/// `BallTerms` of tetrahedra whose target is the ideal one or, if `kReference`, that of a reference
/// mesh without flat ones, laid out for vectors. The passes below compute what the corners add in
/// vectors and sum it up in their order: the bits of the passes over `BallTerms`. To be used inside
/// `run_wide`.
template <class P, bool kReference>
class TetrahedronTerms {
 public:
  using Real = typename P::Real;
  static constexpr bool kTetrahedra = true;
  static constexpr int kBatch = 8;
  using Batch = std::array<double, kBatch>;

  [[nodiscard]] static bool fit(const Surroundings& around, std::size_t node) {
    const std::size_t size = around.balls.size(node);
    return around.opposite != nullptr && (around.targets.reference != nullptr) == kReference &&
           !around.targets.some_flat && size > 0 && size <= kMostBatches * kBatch;
  }

  TetrahedronTerms(const Surroundings& around, const P& x, std::size_t node)
      : around_(around), x_(x), node_(node), count_(static_cast<int>(around.balls.size(node))) {
    move_to(x[node]);
  }

  void move_to(Vec3<Real> position) {
    position_ = position;
    const Vec3d own = vec3_cast<double>(position);
    const NodeId* const others = around_.opposite + 3 * around_.balls.offsets[node_];
    for (int b = 0; b < batch_count(); ++b) {
      const NodeId* const batch = others + 3 * b * kBatch;
      Edges edges, target;
      gather(b, batch, x_, own, edges);
      if constexpr (kReference) {
        const Vec3d* const reference = around_.targets.reference;
        gather(b, batch, reference, reference[node_], target);
      }
      Lanes& lanes = lanes_[b];
      for (int t = 0; t < kBatch; ++t) {
        const CornerTerm term = [&] {
          if constexpr (kReference) {
            return tetrahedron_term(edges.get(0, t), edges.get(1, t), edges.get(2, t),
                                    {target.get(0, t), target.get(1, t), target.get(2, t)});
          } else {
            return tetrahedron_term(edges.get(0, t), edges.get(1, t), edges.get(2, t));
          }
        }();
        lanes.volume[t] = term.volume;
        lanes.size[t] = term.size;
        if constexpr (kReference) lanes.curvature[t] = term.curvature;
        lanes.volume_gradient.set(t, term.volume_gradient);
        lanes.size_gradient.set(t, term.size_gradient);
      }
    }
  }

  [[nodiscard]] Vec3<Real> position() const { return position_; }
  [[nodiscard]] const P& positions() const { return x_; }
  [[nodiscard]] double certainty() const { return around_.targets.certainty; }

  template <class Visitor>
  void for_each(const Visitor& visit) const {
    for (int n = 0; n < count_; ++n) visit(term(n / kBatch, n % kBatch));
  }

  [[nodiscard]] int batch_count() const { return (count_ + kBatch - 1) / kBatch; }
  /// How many terms of a batch count.
  [[nodiscard]] int count_in(int batch) const {
    return count_ - batch * kBatch < kBatch ? count_ - batch * kBatch : kBatch;
  }
  [[nodiscard]] CornerTerm term(int batch, int t) const {
    const Lanes& lanes = lanes_[batch];
    return {
        kTetrahedronWeight,           lanes.volume[t],           lanes.size[t], curvature(lanes, t),
        lanes.volume_gradient.get(t), lanes.size_gradient.get(t)};
  }

 private:
  static constexpr int kMostBatches = 8;

  /// Where the edges of a batch end, and where they begin.
  struct Edges {
    double end[3][3][kBatch];
    Vec3d origin;
    [[nodiscard]] Vec3d get(int m, int t) const {
      return Vec3d{end[m][0][t], end[m][1][t], end[m][2][t]} - origin;
    }
  };
  struct Lanes {
    Batch volume, size;
    std::array<double, kReference ? kBatch : 0> curvature;
    Vectors<kBatch> volume_gradient, size_gradient;
  };

  /// `others`: three nodes of each element, from the first of batch `b` on. The last batch is
  /// filled up by its first element.
  template <class Positions>
  [[gnu::always_inline]] inline void gather(int b, const NodeId* others, const Positions& positions,
                                            Vec3d origin, Edges& edges) const {
    const int size = count_in(b);
    const auto other = [&](int t, int m) { return others[3 * (t < size ? t : 0) + m]; };
    edges.origin = origin;
    for (int t = 0; t < kBatch; t += 4) {
      for (int m = 0; m < 3; ++m) {
        set_four(edges.end[m], t, positions, other(t, m), other(t + 1, m), other(t + 2, m),
                 other(t + 3, m));
      }
    }
  }
  [[nodiscard]] static double curvature([[maybe_unused]] const Lanes& lanes,
                                        [[maybe_unused]] int t) {
    if constexpr (kReference) {
      return lanes.curvature[t];
    } else {
      return kTetrahedronCurvature;
    }
  }

  const Surroundings& around_;
  const P& x_;
  std::size_t node_;
  int count_;
  Vec3<Real> position_;
  Lanes lanes_[kMostBatches];
};

/// `raise` of a batch.
template <class Batch>
void raise_all(Batch& f, int power) {
  for (; power > 1; power /= 2) {
    for (double& value : f) value *= value;
  }
}

template <int kDimension, class P, bool kReference>
BallDerivatives differentiate(const SingleThread& team,
                              const TetrahedronTerms<P, kReference>& terms,
                              const BallEnergy& energy) {
  constexpr int kBatch = TetrahedronTerms<P, kReference>::kBatch;
  using Batch = std::array<double, kBatch>;
  static_assert(kDimension == 3);
  if (energy.epsilon_squared > 0) return differentiate_as<3, true>(team, terms, energy);
  BallDerivatives sum;
  const double p = energy.power;
  const double scale = 1 / (3 * energy.unit);
  bool valid = true;
  for (int b = 0; b < terms.batch_count(); ++b) {
    Batch f, slope, positive;
    for (int t = 0; t < kBatch; ++t) {
      const CornerTerm term = terms.term(b, t);
      const CornerEnergy<3> corner(term.volume, term.size, terms.certainty());
      f[t] = corner.stretch * scale;
      slope[t] = corner.inverse.whole;
      positive[t] = corner.positive ? 1 : 0;
    }
    raise_all(f, energy.power);
    Batch energies, diagonals;
    Vectors<kBatch> gradients;
    Products<kBatch> first, second;
    for (int t = 0; t < kBatch; ++t) {
      const CornerTerm term = terms.term(b, t);
      const CornerDerivatives c = corner_derivatives<3>(term, term.weight * f[t], slope[t], p);
      energies[t] = c.energy;
      gradients.set(t, c.gradient);
      diagonals[t] = c.diagonal;
      first.set(t, c.first);
      second.set(t, c.second);
    }
    for (int t = 0; t < terms.count_in(b); ++t) {
      valid = valid && positive[t] != 0;
      sum.add({energies[t], gradients.get(t), diagonals[t], first.get(t), second.get(t)});
    }
  }
  if (!valid) sum.energy = HUGE_VAL;
  sum.xx += sum.diagonal;
  sum.yy += sum.diagonal;
  sum.zz += sum.diagonal;
  return sum;
}

template <int kDimension, class P, bool kReference>
double energy_at(const SingleThread& team, const TetrahedronTerms<P, kReference>& terms,
                 const BallEnergy& energy, Vec3d d, bool guard) {
  constexpr int kBatch = TetrahedronTerms<P, kReference>::kBatch;
  using Batch = std::array<double, kBatch>;
  static_assert(kDimension == 3);
  if (energy.epsilon_squared > 0) return energy_as<3, true>(team, terms, energy, d, guard);
  const double scale = 1 / (3 * energy.unit);
  bool allowed = true;
  double sum = 0;
  for (int b = 0; b < terms.batch_count(); ++b) {
    Batch f, positive;
    for (int t = 0; t < kBatch; ++t) {
      const CornerTerm term = terms.term(b, t);
      const MovedCorner<3> corner(term, term.volume_at(d), term.size_at(d), terms.certainty());
      f[t] = corner.stretch * scale;
      positive[t] = corner.positive ? 1 : 0;
    }
    raise_all(f, energy.power);
    for (int t = 0; t < terms.count_in(b); ++t) {
      allowed = allowed && positive[t] != 0;
      sum += kTetrahedronWeight * f[t];
    }
  }
  return allowed ? sum : HUGE_VAL;
}

template <int kDimension, class P, bool kReference>
double worst_inverse_ratio(const SingleThread&, const TetrahedronTerms<P, kReference>& terms,
                           Vec3d d) {
  constexpr int kBatch = TetrahedronTerms<P, kReference>::kBatch;
  using Batch = std::array<double, kBatch>;
  static_assert(kDimension == 3);
  bool valid = true;
  double highest = 0;
  for (int b = 0; b < terms.batch_count(); ++b) {
    Batch stretch, positive;
    for (int t = 0; t < kBatch; ++t) {
      const CornerTerm term = terms.term(b, t);
      const MovedCorner<3> corner(term, term.volume_at(d), term.size_at(d), terms.certainty());
      stretch[t] = corner.stretch;
      positive[t] = corner.positive ? 1 : 0;
    }
    for (int t = 0; t < kBatch; ++t) {
      valid = valid && positive[t] != 0;
      if (stretch[t] > highest) highest = stretch[t];
    }
  }
  return valid ? highest / 3 : HUGE_VAL;
}

}  // namespace meshsmooth::detail
