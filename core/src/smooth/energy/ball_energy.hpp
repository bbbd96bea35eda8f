#pragma once

#include <cmath>

#include "mesh/cube_root.hpp"
#include "smooth/base/anchor.hpp"
#include "smooth/energy/corner_term.hpp"

namespace meshsmooth::detail {

/// D^(-2 / dimension), and 1 / D, which the derivatives need.
template <int kDimension>
struct InverseVolume {
  double scale;  // D^(-2 / dimension)
  double whole;  // 1 / D

  MESHSMOOTH_HD explicit InverseVolume(double volume) {
    if constexpr (kDimension == 2) {
      scale = whole = 1 / volume;
    } else {
      const double root = inverse_cbrt(volume);
      scale = root * root;
      whole = scale * root;
    }
  }
};

/// Below this multiple of S^(d/2) the determinant D of a corner does not count as positive.
/// `kSignBound` times the product of the corner's edges is less, as that is below S^(d/2) for
/// every ideal corner; the rest covers the rounding of a moved term (see `MovedCorner`).
inline constexpr double kCertainVolume = 8e-14;
/// The same for S / D^(2/d): its power -2/d.
template <int kDimension>
inline constexpr double kCertainStretch = kDimension == 2 ? 1 / kCertainVolume : 5.386e8;

/// The energy of a corner with this determinant and norm.
template <int kDimension>
struct CornerEnergy {
  InverseVolume<kDimension> inverse;
  double stretch;  // S / D^(2/d): the inverse mean ratio times d
  bool positive;   // certainly; else the other members have no meaning

  /// `certainty` as in `Targets`.
  MESHSMOOTH_HD CornerEnergy(double volume, double size, double certainty)
      : inverse(volume),
        stretch(size * inverse.scale),
        positive(volume > 0 && stretch < certainty * kCertainStretch<kDimension>) {}
};

/// A moved corner: to be certainly positive it must also not have shrunk by more than a factor of
/// ten in one step, or cancellation leaves only rounding in D and S.
template <int kDimension>
struct MovedCorner : CornerEnergy<kDimension> {
  MESHSMOOTH_HD MovedCorner(const CornerTerm& term, double volume, double size, double certainty)
      : CornerEnergy<kDimension>(volume, size, certainty) {
    this->positive = this->positive && size > 0.01 * term.size;
  }
};

/// f^power for a power of two.
MESHSMOOTH_HD inline double raise(double f, int power) {
  for (; power > 1; power /= 2) f *= f;
  return f;
}

/// The energy of a ball: the weighted sum over its corners of f^power, f = S / (d chi(D)^(2/d))
/// the inverse mean ratio, chi(D) = (D + sqrt(D^2 + 4 e^2)) / 2. Source: Garanzha et al. 2021,
/// "Foldover-free maps in 50 lines of code", for chi; Knupp 2001 for f.
struct BallEnergy {
  int power = 1;               // a power of two
  double epsilon_squared = 0;  // 0: corners must be positive
  double unit = 1;             // f is divided by it, so that a high power stays in range
};

/// What one pass over the terms of a ball finds.
struct BallScan {
  bool valid = true;         // every corner is certainly positive
  double lowest_volume = 0;  // of all D and 0
  double size = 0;           // sum of S
  double count = 0;
};

/// The sums of a valid ball are known only if `sums`.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD BallScan scan_ball(const Team& team, const Terms& terms, bool sums) {
  BallScan scan;
  terms.for_each([&](const CornerTerm& term) {
    scan.valid =
        scan.valid && CornerEnergy<kDimension>(term.volume, term.size, terms.certainty()).positive;
    if (term.volume < scan.lowest_volume) scan.lowest_volume = term.volume;
    scan.size += term.size;
    scan.count += 1;
  });
  scan.valid = team.all(scan.valid);
  if (scan.valid && !sums) return scan;
  scan.lowest_volume = team.lowest(scan.lowest_volume);
  scan.size = team.sum(scan.size);
  scan.count = team.sum(scan.count);
  return scan;
}

/// e^2 of a tangled or softened ball: a fifth of its deepest inversion, and a share of its size.
template <int kDimension>
MESHSMOOTH_HD double epsilon_squared(const BallScan& scan, double softness) {
  const double h2 = scan.size / (kDimension * scan.count);
  const double volume_squared = kDimension == 3 ? h2 * h2 * h2 : h2 * h2;
  return (1e-8 + softness * softness) * volume_squared +
         0.04 * scan.lowest_volume * scan.lowest_volume;
}

/// The worst corner of a ball: its inverse mean ratio; HUGE_VAL unless all are certainly
/// positive.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD double worst_inverse_ratio(const Team& team, const Terms& terms, Vec3d d) {
  bool valid = true;
  double highest = 0;
  terms.for_each([&](const CornerTerm& term) {
    const MovedCorner<kDimension> corner(term, term.volume_at(d), term.size_at(d),
                                         terms.certainty());
    valid = valid && corner.positive;
    if (corner.stretch > highest) highest = corner.stretch;
  });
  return -team.lowest(valid ? -highest / kDimension : -HUGE_VAL);
}

/// chi(D), and 1 / sqrt(D^2 + 4 e^2). For D < 0 the sum cancels; the same by its conjugate.
struct Regularized {
  double chi;
  double slope;

  MESHSMOOTH_HD Regularized(double volume, double epsilon_squared) {
    const double root = std::sqrt(volume * volume + 4 * epsilon_squared);
    chi = volume > 0 ? 0.5 * (volume + root) : 2 * epsilon_squared / (root - volume);
    slope = 1 / root;
  }
};

/// `energy_at` for epsilon above 0 or not.
template <int kDimension, bool kRegularised, class Team, class Terms>
MESHSMOOTH_HD double energy_as(const Team& team, const Terms& terms, const BallEnergy& energy,
                               Vec3d d, bool guard) {
  bool allowed = true;
  double sum = 0;
  const double scale = 1 / (kDimension * energy.unit);
  terms.for_each([&](const CornerTerm& term) {
    double volume = term.volume_at(d);
    const double size = term.size_at(d);
    double stretch = 0;
    if constexpr (kRegularised) {
      if (guard && CornerEnergy<kDimension>(term.volume, term.size, terms.certainty()).positive) {
        allowed =
            allowed && MovedCorner<kDimension>(term, volume, size, terms.certainty()).positive;
      }
      volume = Regularized(volume, energy.epsilon_squared).chi;
      stretch = size * InverseVolume<kDimension>(volume).scale;
    } else {
      const MovedCorner<kDimension> corner(term, volume, size, terms.certainty());
      allowed = allowed && corner.positive;
      stretch = corner.stretch;
    }
    const double f = stretch * scale;
    sum += term.weight * raise(f, energy.power);
  });
  return team.sum(allowed ? sum : HUGE_VAL);
}

/// The energy with the node displaced by `d`; HUGE_VAL if that is not allowed: with
/// epsilon 0 every corner must be certainly positive, else, if `guard`, those that were.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD double energy_at(const Team& team, const Terms& terms, const BallEnergy& energy,
                               Vec3d d, bool guard) {
  return energy.epsilon_squared > 0 ? energy_as<kDimension, true>(team, terms, energy, d, guard)
                                    : energy_as<kDimension, false>(team, terms, energy, d, guard);
}

/// What one corner adds to `BallDerivatives`.
struct CornerDerivatives {
  /// Entries of a product of two vectors whose symmetric part counts.
  struct Product {
    double xx, yy, zz, xy, xz, yz;
  };
  double energy;
  Vec3d gradient;
  double diagonal;
  Product first, second;
};
MESHSMOOTH_HD inline CornerDerivatives::Product product(Vec3d a, Vec3d b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z, a.x * b.y, a.x * b.z, a.y * b.z};
}

/// Energy E, and of log-derivatives weighted by each corner's share F of it:
/// gradient = sum F u, Hessian = sum F (p u u' + (sigma / S) I - a a' + d/2 b b'), with
/// a = grad S / S, b = (2/d) grad D / D, u = a - b. The true ones are p times these.
struct BallDerivatives {
  double energy = 0;  // HUGE_VAL where, without epsilon, a corner is not certainly positive
  Vec3d gradient{0, 0, 0};
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  double diagonal = 0;  // to be added to xx, yy and zz

  MESHSMOOTH_HD void add(const CornerDerivatives& c) {
    energy += c.energy;
    gradient += c.gradient;
    diagonal += c.diagonal;
    xx = xx + c.first.xx + c.second.xx;
    yy = yy + c.first.yy + c.second.yy;
    zz = zz + c.first.zz + c.second.zz;
    xy = xy + c.first.xy + c.second.xy;
    xz = xz + c.first.xz + c.second.xz;
    yz = yz + c.first.yz + c.second.yz;
  }

  /// Without epsilon: every corner is certainly positive. Else the other members have no meaning.
  [[nodiscard]] MESHSMOOTH_HD bool valid() const { return energy < HUGE_VAL; }
};

/// Those of a corner with the energy `f`; `slope` is 1 / D or its regularization.
template <int kDimension>
MESHSMOOTH_HD CornerDerivatives corner_derivatives(const CornerTerm& term, double f, double slope,
                                                   double p) {
  constexpr double kHalf = kDimension / 2.0;
  const double per_size = 1 / term.size;
  const Vec3d a = per_size * term.size_gradient;
  const Vec3d b = (2.0 / kDimension * slope) * term.volume_gradient;
  const Vec3d u = a - b;
  // p u u' - a a' + d/2 b b' with a = u + b is u v' + b w'.
  const Vec3d v = f * ((p - 1) * u - b);
  const Vec3d w = f * ((kHalf - 1) * b - u);
  return {f, f * u, f * (term.curvature * per_size), product(u, v), product(b, w)};
}

/// Adds an anchor's share at a position to the derivatives of the energy of this power.
MESHSMOOTH_HD inline void add_anchor(const Anchor& anchor, Vec3d position, int power,
                                     BallDerivatives& at) {
  const double second = 2 * anchor.weight / power;
  at.energy += anchor.energy(position);
  at.gradient += second * (position - anchor.home);
  at.xx += second;
  at.yy += second;
  at.zz += second;
}

/// `differentiate` for epsilon above 0 or not.
template <int kDimension, bool kRegularised, class Team, class Terms>
MESHSMOOTH_HD BallDerivatives differentiate_as(const Team& team, const Terms& terms,
                                               const BallEnergy& energy) {
  BallDerivatives sum;
  const double p = energy.power;
  const double scale = 1 / (kDimension * energy.unit);
  bool valid = true;
  terms.for_each([&](const CornerTerm& term) {
    double stretch = 0;
    double slope = 0;  // 1 / D, or its regularization
    if constexpr (kRegularised) {
      const Regularized regularized(term.volume, energy.epsilon_squared);
      stretch = term.size * InverseVolume<kDimension>(regularized.chi).scale;
      slope = regularized.slope;
    } else {
      const CornerEnergy<kDimension> corner(term.volume, term.size, terms.certainty());
      valid = valid && corner.positive;
      stretch = corner.stretch;
      slope = corner.inverse.whole;
    }
    const double f = term.weight * raise(stretch * scale, energy.power);
    sum.add(corner_derivatives<kDimension>(term, f, slope, p));
  });
  sum.energy = team.sum(valid ? sum.energy : HUGE_VAL);
  sum.gradient = {team.sum(sum.gradient.x), team.sum(sum.gradient.y), team.sum(sum.gradient.z)};
  sum.xx = team.sum(sum.xx + sum.diagonal);
  sum.xy = team.sum(sum.xy);
  sum.xz = team.sum(sum.xz);
  sum.yy = team.sum(sum.yy + sum.diagonal);
  sum.yz = team.sum(sum.yz);
  sum.zz = team.sum(sum.zz + sum.diagonal);
  return sum;
}

/// Where the ball is valid each term is strictly convex and the Hessian exact. With
/// epsilon > 0 b is divided by sqrt(D^2 + 4 e^2) instead of D, which leaves out a
/// negative part: the matrix stays positive definite.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD BallDerivatives differentiate(const Team& team, const Terms& terms,
                                            const BallEnergy& energy) {
  return energy.epsilon_squared > 0 ? differentiate_as<kDimension, true>(team, terms, energy)
                                    : differentiate_as<kDimension, false>(team, terms, energy);
}

}  // namespace meshsmooth::detail
