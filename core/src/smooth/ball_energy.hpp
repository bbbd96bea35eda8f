#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "smooth/corner_term.hpp"

namespace meshsmooth::detail {

/// x^(-1/3) for a positive, normal x, to about two units in the last place, by
/// operations that host and device round alike: a guess from the exponent, then two
/// steps of fourth order.
MESHSMOOTH_HD inline double inverse_cbrt(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  const std::uint64_t third = ((bits >> 32) * 0x55555556U) >> 32;
  bits = (std::uint64_t{0x553ef0ff} - third) << 32;
  double y = 0;
  std::memcpy(&y, &bits, sizeof y);
  for (int step = 0; step < 2; ++step) {
    const double h = 1 - (x * y) * (y * y);
    y += y * h * (1.0 / 3 + h * (2.0 / 9 + h * (14.0 / 81)));
  }
  return y;
}

/// D^(2 / dimension) turned over, and its square root's power that the derivatives need.
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

/// f^power for a power of two.
MESHSMOOTH_HD inline double raise(double f, int power) {
  for (; power > 1; power /= 2) f *= f;
  return f;
}

/// What a ball is worth: the weighted sum over its corners of f^power, f = S / (d chi(D)^(2/d)) the
/// inverse mean ratio, chi(D) = (D + sqrt(D^2 + 4 e^2)) / 2. Source: Garanzha et al. 2021,
/// "Foldover-free maps in 50 lines of code", for chi; Knupp 2001 for f.
struct BallEnergy {
  int power = 1;               // a power of two
  double epsilon_squared = 0;  // 0: corners must be positive
  double unit = 1;             // f is counted in it, so that a high power stays in range
};

/// The terms of a ball in one look.
struct BallScan {
  bool valid = true;         // every corner is certainly positive
  double lowest_volume = 0;  // of all D and 0
  double size = 0;           // sum of S
  double count = 0;
};

template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD BallScan scan_ball(const Team& team, const Terms& terms) {
  BallScan scan;
  terms.for_each([&](const CornerTerm& term) {
    scan.valid = scan.valid && certainly_positive<kDimension>(term.volume, term.size);
    if (term.volume < scan.lowest_volume) scan.lowest_volume = term.volume;
    scan.size += term.size;
    scan.count += 1;
  });
  scan.valid = team.all(scan.valid);
  if (scan.valid) return scan;
  scan.lowest_volume = team.lowest(scan.lowest_volume);
  scan.size = team.sum(scan.size);
  scan.count = team.sum(scan.count);
  return scan;
}

/// e^2 of a tangled ball: a fifth of its deepest inversion, and a little of its size.
template <int kDimension>
MESHSMOOTH_HD double epsilon_squared(const BallScan& scan) {
  const double h2 = scan.size / (kDimension * scan.count);
  const double volume_squared = kDimension == 3 ? h2 * h2 * h2 : h2 * h2;
  return 1e-8 * volume_squared + 0.04 * scan.lowest_volume * scan.lowest_volume;
}

/// The worst corner of a ball: its inverse mean ratio; HUGE_VAL unless all are certainly
/// positive.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD double worst_inverse_ratio(const Team& team, const Terms& terms, Vec3d d) {
  bool valid = true;
  double lowest = HUGE_VAL;  // of D^2 / S^d: no root per corner
  terms.for_each([&](const CornerTerm& term) {
    const double volume = term.volume_at(d);
    const double size = term.size_at(d);
    valid = valid && certainly_positive<kDimension>(term, volume, size);
    const double ratio = kDimension == 2 ? volume / size : volume * volume / (size * size * size);
    if (ratio < lowest) lowest = ratio;
  });
  if (!team.all(valid)) return HUGE_VAL;
  lowest = team.lowest(lowest);
  return kDimension == 2 ? 0.5 / lowest : inverse_cbrt(27 * lowest);
}

/// The energy with the node displaced by `d`; HUGE_VAL where that is not allowed: with
/// epsilon 0 every corner must be certainly positive, else, if `guard`, those that were.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD double energy_at(const Team& team, const Terms& terms, const BallEnergy& energy,
                               Vec3d d, bool guard) {
  bool allowed = true;
  double sum = 0;
  const double scale = 1 / (kDimension * energy.unit);
  const double e2 = energy.epsilon_squared;
  terms.for_each([&](const CornerTerm& term) {
    double volume = term.volume_at(d);
    const double size = term.size_at(d);
    if (e2 == 0 || (guard && certainly_positive<kDimension>(term.volume, term.size))) {
      allowed = allowed && certainly_positive<kDimension>(term, volume, size);
    }
    if (e2 > 0) {
      // For D < 0 the sum cancels; the same by its conjugate.
      const double root = std::sqrt(volume * volume + 4 * e2);
      volume = volume > 0 ? 0.5 * (volume + root) : 2 * e2 / (root - volume);
    }
    const double f = size * InverseVolume<kDimension>(volume).scale * scale;
    sum += term.weight * raise(f, energy.power);
  });
  if (!team.all(allowed)) return HUGE_VAL;
  return team.sum(sum);
}

/// Energy E, and of log-derivatives weighted by each corner's share F of it:
/// gradient = sum F u, Hessian = sum F (p u u' + (sigma / S) I - a a' + d/2 b b'), with
/// a = grad S / S, b = (2/d) grad D / D, u = a - b. The true ones are p times these.
struct BallDerivatives {
  double energy = 0;
  Vec3d gradient{0, 0, 0};
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  bool valid = true;  // else, without epsilon, the rest means nothing
};

/// Where the ball is valid each term is strictly convex and the Hessian exact. With
/// epsilon > 0 b is divided by sqrt(D^2 + 4 e^2) instead of D, which leaves out a
/// negative part: the matrix stays positive definite.
template <int kDimension, class Team, class Terms>
MESHSMOOTH_HD BallDerivatives differentiate(const Team& team, const Terms& terms,
                                            const BallEnergy& energy) {
  BallDerivatives sum;
  const double p = energy.power;
  const double scale = 1 / (kDimension * energy.unit);
  const double e2 = energy.epsilon_squared;
  constexpr double kHalf = kDimension / 2.0;
  terms.for_each([&](const CornerTerm& term) {
    double chi = term.volume;
    double slope = 0;  // 1 / D, or what stands for it
    if (e2 > 0) {
      const double root = std::sqrt(term.volume * term.volume + 4 * e2);
      chi = term.volume > 0 ? 0.5 * (term.volume + root) : 2 * e2 / (root - term.volume);
      slope = 1 / root;
    }
    sum.valid = sum.valid && certainly_positive<kDimension>(term.volume, term.size);
    const InverseVolume<kDimension> inverse(chi);
    if (e2 == 0) slope = inverse.whole;
    const double f = term.weight * raise(term.size * inverse.scale * scale, energy.power);
    const double per_size = 1 / term.size;
    const Vec3d a = per_size * term.size_gradient;
    const Vec3d b = (2.0 / kDimension * slope) * term.volume_gradient;
    const Vec3d u = a - b;
    const Vec3d fu = (f * p) * u;
    const Vec3d fa = f * a;
    const Vec3d fb = (f * kHalf) * b;
    const double diagonal = f * (term.curvature * per_size);
    sum.energy += f;
    sum.gradient += f * u;
    sum.xx += fu.x * u.x - fa.x * a.x + fb.x * b.x + diagonal;
    sum.yy += fu.y * u.y - fa.y * a.y + fb.y * b.y + diagonal;
    sum.zz += fu.z * u.z - fa.z * a.z + fb.z * b.z + diagonal;
    sum.xy += fu.x * u.y - fa.x * a.y + fb.x * b.y;
    sum.xz += fu.x * u.z - fa.x * a.z + fb.x * b.z;
    sum.yz += fu.y * u.z - fa.y * a.z + fb.y * b.z;
  });
  sum.valid = team.all(sum.valid);
  sum.energy = team.sum(sum.energy);
  sum.gradient = {team.sum(sum.gradient.x), team.sum(sum.gradient.y), team.sum(sum.gradient.z)};
  sum.xx = team.sum(sum.xx);
  sum.xy = team.sum(sum.xy);
  sum.xz = team.sum(sum.xz);
  sum.yy = team.sum(sum.yy);
  sum.yz = team.sum(sum.yz);
  sum.zz = team.sum(sum.zz);
  return sum;
}

/// A Newton step and what it promises: L = g' H^-1 g / E. Zero where the matrix is not
/// positive definite in double.
struct NewtonStep {
  Vec3d direction{0, 0, 0};
  double decrement = 0;
};

/// In space, by L D L'.
MESHSMOOTH_HD inline NewtonStep newton_step(const BallDerivatives& at) {
  const Vec3d g = at.gradient;
  const double l10 = at.xy / at.xx, l20 = at.xz / at.xx;
  const double d1 = at.yy - l10 * at.xy;
  const double m21 = at.yz - l10 * at.xz;
  const double l21 = m21 / d1;
  const double d2 = at.zz - l20 * at.xz - l21 * m21;
  if (!(at.xx > 0 && d1 > 0 && d2 > 0)) return {};
  const double y1 = g.y - l10 * g.x;
  const double y2 = g.z - l20 * g.x - l21 * y1;
  const double z = y2 / d2;
  const double y = y1 / d1 - l21 * z;
  const double x = g.x / at.xx - l10 * y - l20 * z;
  const Vec3d direction{-x, -y, -z};
  return {direction, -dot(g, direction) / at.energy};
}

/// Along the line with this unit direction.
MESHSMOOTH_HD inline NewtonStep newton_step_on_line(const BallDerivatives& at, Vec3d direction) {
  const Vec3d t = direction;
  const double g = dot(at.gradient, t);
  const double curvature = at.xx * t.x * t.x + at.yy * t.y * t.y + at.zz * t.z * t.z +
                           2 * (at.xy * t.x * t.y + at.xz * t.x * t.z + at.yz * t.y * t.z);
  if (!(curvature > 0)) return {};
  return {(-g / curvature) * t, g * g / (curvature * at.energy)};
}

/// In the plane with this unit normal: exactly in it where it is a coordinate plane.
MESHSMOOTH_HD inline NewtonStep newton_step_in_plane(const BallDerivatives& at, Vec3d normal) {
  const double ax = std::abs(normal.x), ay = std::abs(normal.y), az = std::abs(normal.z);
  const Vec3d axis = ax <= ay && ax <= az ? Vec3d{1, 0, 0}
                     : ay <= az           ? Vec3d{0, 1, 0}
                                          : Vec3d{0, 0, 1};
  const Vec3d across = cross(normal, axis);
  const Vec3d s = (1 / norm(across)) * across;
  const Vec3d t = cross(normal, s);
  const auto times = [&](Vec3d v) {
    return Vec3d{at.xx * v.x + at.xy * v.y + at.xz * v.z, at.xy * v.x + at.yy * v.y + at.yz * v.z,
                 at.xz * v.x + at.yz * v.y + at.zz * v.z};
  };
  const Vec3d hs = times(s);
  const double ss = dot(s, hs), st = dot(t, hs), tt = dot(t, times(t));
  const double gs = dot(at.gradient, s), gt = dot(at.gradient, t);
  const double d1 = tt - st * st / ss;
  if (!(ss > 0 && d1 > 0)) return {};
  const double yt = (gt - gs * st / ss) / d1;
  const double ys = (gs - st * yt) / ss;
  return {-1.0 * (ys * s + yt * t), (gs * ys + gt * yt) / at.energy};
}

}  // namespace meshsmooth::detail
