#pragma once

#include <cmath>
#include <limits>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// Whether `tetrahedron_is_positive` is certain wherever each node is on its way from `before[n]`
/// to `after[n]`, as positions of type Real. Evaluated in float; false can mean undecided.
///
/// The determinant is affine in the position of each node, so that it is least where all nodes are
/// at an end of their ways. Relative to a node, with coordinates of at most l along an axis and
/// u = 2^-24, edges are at most 2l and err by 4ul; the six products of the determinant by 288ul^3,
/// their evaluation by 240ul^3. Where the way itself is rounded, coordinates of at most r and a
/// unit w of Real add less than 600wl^2r.
template <class Real, class Before, class After>
MESHSMOOTH_HD bool is_positive_on_the_way(const Before& before, const After& after) {
  constexpr float kUnit = 0x1p-24F;
  constexpr float kRealUnit = static_cast<float>(std::numeric_limits<Real>::epsilon());
  constexpr float kSmallest = 1e-30F;
  const auto larger = [](float a, float b) { return a > b ? a : b; };
  const auto reach = [&](Vec3f p) {
    return larger(larger(p.x < 0 ? -p.x : p.x, p.y < 0 ? -p.y : p.y), p.z < 0 ? -p.z : p.z);
  };
  const Vec3d origin = vec3_cast<double>(before(0));
  Vec3f ends[2][4];
  float l = 0;
  for (int n = 0; n < 4; ++n) {
    ends[0][n] = vec3_cast<float>(vec3_cast<double>(before(n)) - origin);
    ends[1][n] = vec3_cast<float>(vec3_cast<double>(after(n)) - origin);
    l = larger(l, larger(reach(ends[0][n]), reach(ends[1][n])));
  }
  const float r = reach(vec3_cast<float>(origin)) + l;
  const float bound = l * l * (600 * kUnit * l + 600 * kRealUnit * r) + kSmallest;
  bool positive = true;
  for (const auto& first : ends) {
    for (const auto& third : ends) {
      for (const auto& fourth : ends) {
        const Vec3f normal = cross(third[2] - first[0], fourth[3] - first[0]);
        for (const auto& second : ends) {
          positive = positive && dot(second[1] - first[0], normal) > bound;
        }
      }
    }
  }
  return positive;
}

/// Whether `tetrahedron_is_positive` is certain wherever each node is within `radius[n]` of
/// `centre[n]`: a coarser test than that above, of a third of the work.
///
/// The determinant is affine in the position of each node: with moves d_n it changes by the sums of
/// d_n N_n, N_n the normal of the opposite face, of (d_m x d_n) e, e the opposite edge, and of
/// (d_k x d_m) d_n. With edges of at most l, s the sum of the radii and u = 2^-24, rounding adds
/// less than 10ul^3 to the determinant, 25ul^2s to the first sum and a share of 16u to the others.
MESHSMOOTH_HD inline bool is_positive_within(const Vec3f (&centre)[4], const float (&radius)[4]) {
  constexpr float kUnit = 0x1p-24F;
  constexpr float kSmallest = 1e-30F;
  const Vec3f a = centre[1] - centre[0], b = centre[2] - centre[0], c = centre[3] - centre[0];
  const Vec3f edges[] = {a, b, c, b - a, c - b, a - c};
  const Vec3f normal[] = {cross(edges[3], edges[4]), cross(b, c), cross(c, a), cross(a, b)};
  const float(&r)[4] = radius;
  float longest = 0, first = 0;
  for (const Vec3f& edge : edges) {
    const float square = dot(edge, edge);
    longest = square > longest ? square : longest;
  }
  for (int n = 0; n < 4; ++n) first += r[n] * std::sqrt(dot(normal[n], normal[n]));
  const float l = std::sqrt(longest);
  const float r01 = r[0] + r[1], r23 = r[2] + r[3];
  const float second = r[0] * r[1] + r[2] * r[3] + r01 * r23;
  const float third = r[0] * r[1] * r23 + r[2] * r[3] * r01;
  const float size = l + r01 + r23;
  return dot(a, normal[1]) >
         first + second * l + third + 64 * kUnit * size * size * size + kSmallest;
}

/// In float, relative to an origin.
struct BoundingSphere {
  Vec3f centre;
  float radius;
};

/// Contains every position to which a node's move may be cut, rounding included.
template <class Real>
MESHSMOOTH_HD BoundingSphere bounding_sphere_of_move(Vec3<Real> before, Vec3<Real> after,
                                                     Vec3d origin) {
  constexpr float kRounding = 64 * static_cast<float>(std::numeric_limits<Real>::epsilon());
  const Vec3d from = vec3_cast<double>(before), to = vec3_cast<double>(after);
  const Vec3f centre = vec3_cast<float>(0.5 * (from + to) - origin);
  const Vec3d middle = vec3_cast<double>(centre) + origin;
  const Vec3f half_from = vec3_cast<float>(from - middle), half_to = vec3_cast<float>(to - middle);
  const float from_square = dot(half_from, half_from), to_square = dot(half_to, half_to);
  const Vec3f far = vec3_cast<float>(from);
  const float reach = std::abs(far.x) + std::abs(far.y) + std::abs(far.z);
  const float radius = std::sqrt(from_square > to_square ? from_square : to_square);
  return {centre, radius + 1e-6F * radius + kRounding * (reach + radius)};
}

}  // namespace meshsmooth::detail
