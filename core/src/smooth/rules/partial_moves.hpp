#pragma once

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

}  // namespace meshsmooth::detail
