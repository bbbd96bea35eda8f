#pragma once

// The sign of an element's Jacobian by interval arithmetic on ever smaller parts of the element.

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "meshsmooth/element.hpp"
#include "meshsmooth/vec3.hpp"

namespace meshsmooth::test::oracle {

struct Interval {
  double low, high;

  friend Interval operator*(Interval a, Interval b) {
    const double products[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
    return {*std::min_element(products, products + 4), *std::max_element(products, products + 4)};
  }
  friend Interval operator-(Interval a, Interval b) { return {a.low - b.high, a.high - b.low}; }
  friend Interval operator+(Interval a, Interval b) { return {a.low + b.low, a.high + b.high}; }
};

/// The three columns of the Jacobian's matrix at a point of the unit cube; each is linear in every
/// coordinate. In a surface element the third is the z axis.
inline std::array<Vec3d, 3> derivatives(ElementType type, std::span<const Vec3d> p,
                                        const std::array<double, 3>& at) {
  const auto [u, v, w] = at;
  const auto between = [](Vec3d a, Vec3d b, double t) { return (1 - t) * a + t * b; };
  if (type == ElementType::wedge) {
    const Vec3d up = between(p[3] - p[0], between(p[4] - p[1], p[5] - p[2], v), u);
    return {between(p[2] - p[0], p[5] - p[3], w), between(p[1] - p[0], p[4] - p[3], w), up};
  }
  const Vec3d along = between(p[1] - p[0], p[2] - p[3], v);
  const Vec3d across = between(p[3] - p[0], p[2] - p[1], u);
  if (type == ElementType::quad) return {along, across, Vec3d{0, 0, 1}};
  const Vec3d base = between(between(p[0], p[1], u), between(p[3], p[2], u), v);
  if (type == ElementType::pyramid) return {along, across, p[4] - base};
  const Vec3d top = between(between(p[4], p[5], u), between(p[7], p[6], u), v);
  return {between(along, between(p[5] - p[4], p[6] - p[7], v), w),
          between(across, between(p[7] - p[4], p[6] - p[5], u), w), top - base};
}

/// Whether the Jacobian may be negative between positive corners.
inline bool has_inside(ElementType type) {
  return type != ElementType::triangle && type != ElementType::tetrahedron;
}

/// False: positive everywhere; true: negative somewhere; nothing: not decided by `most` parts.
inline std::optional<bool> is_negative_somewhere(ElementType type, std::span<const Vec3d> p,
                                                 std::size_t most = 20'000) {
  struct Part {
    std::array<double, 3> low;
    double size;
  };
  std::vector<Part> parts = {{{0, 0, 0}, 1}};
  for (std::size_t done = 0; !parts.empty(); ++done) {
    if (done == most) return std::nullopt;
    const Part part = parts.back();
    parts.pop_back();
    Interval range[3][3];
    for (auto& column : range) std::fill(column, column + 3, Interval{1e300, -1e300});
    for (int corner = 0; corner < 8; ++corner) {
      std::array<double, 3> at = part.low;
      for (int k = 0; k < 3; ++k) at[k] += (corner >> k & 1) * part.size;
      const std::array<Vec3d, 3> columns = derivatives(type, p, at);
      if (dot(columns[0], cross(columns[1], columns[2])) < -1e-12) return true;
      for (int c = 0; c < 3; ++c) {
        const double values[] = {columns[c].x, columns[c].y, columns[c].z};
        for (int k = 0; k < 3; ++k) {
          range[c][k] = {std::min(range[c][k].low, values[k]),
                         std::max(range[c][k].high, values[k])};
        }
      }
    }
    const auto& [a, b, c] = range;
    const Interval determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) +
                                 a[1] * (b[2] * c[0] - b[0] * c[2]) +
                                 a[2] * (b[0] * c[1] - b[1] * c[0]);
    if (determinant.low > 0) continue;
    for (int child = 0; child < 8; ++child) {
      Part next{part.low, part.size / 2};
      for (int k = 0; k < 3; ++k) next.low[k] += (child >> k & 1) * next.size;
      parts.push_back(next);
    }
  }
  return false;
}

}  // namespace meshsmooth::test::oracle
