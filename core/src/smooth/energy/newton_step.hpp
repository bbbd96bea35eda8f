#pragma once

#include <cmath>

#include "smooth/energy/ball_energy.hpp"

namespace meshsmooth::detail {

/// A Newton step and its predicted gain L = g' H^-1 g / E. Zero if the matrix is not
/// positive definite in double.
struct NewtonStep {
  Vec3d direction{0, 0, 0};
  double decrement = 0;
};

/// In space, by L D L'.
MESHSMOOTH_HD inline NewtonStep newton_step(const BallDerivatives& at) {
  const Vec3d g = at.gradient;
  const double r0 = 1 / at.xx;
  const double l10 = at.xy * r0, l20 = at.xz * r0;
  const double d1 = at.yy - l10 * at.xy;
  const double r1 = 1 / d1;
  const double m21 = at.yz - l10 * at.xz;
  const double l21 = m21 * r1;
  const double d2 = at.zz - l20 * at.xz - l21 * m21;
  if (!(at.xx > 0 && d1 > 0 && d2 > 0)) return {};
  const double y1 = g.y - l10 * g.x;
  const double y2 = g.z - l20 * g.x - l21 * y1;
  const double z = y2 / d2;
  const double y = y1 * r1 - l21 * z;
  const double x = g.x * r0 - l10 * y - l20 * z;
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
