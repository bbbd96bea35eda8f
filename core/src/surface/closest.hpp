#pragma once

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// The point of a facet, or of a crease, that is nearest to another.
struct Closest {
  Vec3d position;
  double squared;  // the distance's square
  int at = -1;     // -1: inside; k: on the facet's edge k; 4 + k: at its node k
};

MESHSMOOTH_HD inline Closest closest_at(Vec3d position, Vec3d to, int at) {
  const Vec3d way = to - position;
  return {position, dot(way, way), at};
}

/// Of the segment a-b: at its edge 0, or at 4 or 5.
MESHSMOOTH_HD inline Closest closest_on_segment(Vec3d a, Vec3d b, Vec3d p) {
  const Vec3d ab = b - a;
  const double along = dot(p - a, ab);
  if (!(along > 0)) return closest_at(a, p, 4);
  const double whole = dot(ab, ab);
  if (along >= whole) return closest_at(b, p, 5);
  return closest_at(a + (along / whole) * ab, p, 0);
}

/// Of the triangle a-b-c, by the region of its plane that p lies over. Source: Ericson,
/// "Real-Time Collision Detection", 2005, section 5.1.5.
MESHSMOOTH_HD inline Closest closest_on_triangle(Vec3d a, Vec3d b, Vec3d c, Vec3d p) {
  const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0.0; };
  const Vec3d ab = b - a, ac = c - a;
  const Vec3d ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return closest_at(a, p, 4);
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return closest_at(b, p, 5);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return closest_at(a + share(d1, d1 - d3) * ab, p, 0);
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return closest_at(c, p, 6);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return closest_at(a + share(d2, d2 - d6) * ac, p, 2);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return closest_at(b + share(d4 - d3, (d4 - d3) + (d5 - d6)) * (c - b), p, 1);
  }
  const double sum = va + vb + vc;
  return closest_at(a + (share(vb, sum) * ab + share(vc, sum) * ac), p, -1);
}

}  // namespace meshsmooth::detail
