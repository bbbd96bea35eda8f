#pragma once

#include "smooth/rules/ball_energy.hpp"

namespace meshsmooth::detail {

/// 0 up to `from`, 1 from `to` on, smooth in between.
MESHSMOOTH_HD inline double smooth_step(double from, double to, double x) {
  const double t = (x - from) / (to - from);
  return t <= 0 ? 0 : t >= 1 ? 1 : t * t * (3 - 2 * t);
}

/// The length in `BoxLengths` that an edge of a quadrilateral or a volume element that is no
/// simplex belongs to.
MESHSMOOTH_HD inline int box_length(const ElementShape& shape, int a, int b) {
  if (shape.node_count != 6) return box_direction(a, b);
  if (a % 3 == b % 3) return 0;
  const int sum = a % 3 + b % 3;
  return sum == 1 ? 1 : sum == 3 ? 2 : 3;
}

/// The mean edge lengths of an element; a pyramid's third one is of the edges at its apex.
template <class Get>
MESHSMOOTH_HD void mean_lengths(const ElementShape& shape, const Get& get, double (&lengths)[4]) {
  int counts[4] = {0, 0, 0, 0};
  for (double& length : lengths) length = 0;
  for (int n = 0; n < shape.edge_count; ++n) {
    const int a = shape.edges[n][0], b = shape.edges[n][1];
    const int at = box_length(shape, a, b);
    lengths[at] += norm(get(b) - get(a));
    ++counts[at];
  }
  for (int k = 0; k < 4; ++k) lengths[k] = counts[k] > 0 ? lengths[k] / counts[k] : 1;
}

/// The least mean ratio of an element's corners against the targets `target(k)`; 0 where one is
/// inverted.
template <int kDimension, class Get, class CornerOf>
MESHSMOOTH_HD double least_mean_ratio(const ElementShape& shape, const Get& get, Vec3d reference,
                                      const CornerOf& target) {
  double least = 1;
  for (int k = 0; k < shape.corner_count; ++k) {
    const Vec3d origin = get(shape.corners[k].node);
    const CornerTerm term = corner_term<kDimension>(
        shape, k, -1, [&](int n) { return get(n) - origin; }, target(k), reference);
    if (!(term.volume > 0)) return 0;
    const double ratio = kDimension / CornerEnergy<kDimension>(term.volume, term.size, 1).stretch;
    if (!(ratio >= least)) least = ratio;
  }
  return least;
}

/// Scales a wedge's triangle `box` so that a wedge with the triangle `own` has no stress along its
/// height: then the squared norm of the map from one to the other is 2. For edges w and area A of
/// `box` it is the sum of own_i^2 (w_j^2 + w_k^2 - w_i^2) / (8 A^2). False where `box` is flat.
MESHSMOOTH_HD inline bool fit_triangle(const double (&own)[4], double (&box)[4]) {
  const double u = box[1] * box[1], v = box[2] * box[2], w = box[3] * box[3];
  const double sixteen_areas_squared = 2 * (u * v + v * w + w * u) - (u * u + v * v + w * w);
  const double sum = u + v + w;
  if (!(sixteen_areas_squared * (kBoxSkewness * kBoxSkewness) > sum * sum)) return false;
  const double norm_squared = 2 *
                              (own[1] * own[1] * (v + w - u) + own[2] * own[2] * (w + u - v) +
                               own[3] * own[3] * (u + v - w)) /
                              sixteen_areas_squared;
  const double scale = std::sqrt(norm_squared / 2);
  for (int k = 1; k < 4; ++k) box[k] *= scale;
  return true;
}

/// A ratio to a power, exact for 0 and 1.
MESHSMOOTH_HD inline double blend(double ratio, double power) {
  return power <= 0 ? 1 : power >= 1 ? ratio : std::exp(power * std::log(ratio));
}

/// How much of an aspect ratio is meant: nothing up to `kChanceAspect`, which distorted elements of
/// equal edges have too, quadrilaterals more than hexahedra; all of it from twice that on.
template <int kDimension>
inline constexpr double kChanceAspect = kDimension == 3 ? 3 : 4;
/// From this quality against its own box on an element has right angles.
inline constexpr double kNearlySquare = 0.9999;
inline constexpr double kSquare = 0.99999;

/// The box that an element without a reference aims at: right angles at its own aspect ratio where
/// this is meant, as in a boundary layer, else equal edges. It counts as meant where the angles are
/// right already, and where it is larger than in distorted elements of equal edges.
///
/// A perfect layer is then a fixed point: every corner of a hexahedron has its target's shape; the
/// triangles of wedges pull sideways only.
template <int kDimension, class Get>
MESHSMOOTH_HD BoxLengths box_of(const ElementShape& shape, const Get& get, Vec3d reference) {
  constexpr BoxLengths kEqual{{1, 1, 1, 1}};
  const bool wedge = shape.node_count == 6;
  double own[4];
  mean_lengths(shape, get, own);
  // A pyramid's height follows from its base: its own one is the least certain of all lengths.
  if (shape.node_count == 5) own[2] = std::sqrt(own[0] * own[1]);
  // Lengths of which the ratio is 1 in the ideal element.
  double lengths[3] = {own[0], own[1], kDimension == 3 ? own[2] : own[0]};
  if (wedge) lengths[1] = lengths[2] = std::cbrt(own[1] * own[2] * own[3]);
  double longest = 0, shortest = HUGE_VAL, mean = 1;
  for (int m = 0; m < kDimension; ++m) {
    longest = lengths[m] > longest ? lengths[m] : longest;
    shortest = lengths[m] < shortest ? lengths[m] : shortest;
    mean *= lengths[m];
  }
  if (!(shortest > 0 && longest < 1e12 * shortest)) return kEqual;
  mean = kDimension == 3 ? std::cbrt(mean) : std::sqrt(mean);

  double box[4] = {own[0] / mean, own[1] / mean, own[2] / mean, own[3] / mean};
  const auto stored = [&] {
    return BoxLengths{{static_cast<float>(box[0]), static_cast<float>(box[1]),
                       static_cast<float>(box[2]), static_cast<float>(box[3])}};
  };
  const double aspect =
      smooth_step(kChanceAspect<kDimension>, 2 * kChanceAspect<kDimension>, longest / shortest);
  const double ratio = least_mean_ratio<kDimension>(
      shape, get, reference, [&](int k) { return box_corner<kDimension>(shape, stored(), k); });
  const double square = smooth_step(kNearlySquare, kSquare, ratio);
  const double meant = aspect > square ? aspect : square;
  if (meant == 0) return kEqual;
  for (int m = 0; m < kDimension; ++m) box[m] = blend(lengths[m] / mean, meant);
  if (wedge) {
    // Its triangle keeps its shape in a thin element only.
    const double own_triangle[4] = {1, own[1] / lengths[1], own[2] / lengths[1],
                                    own[3] / lengths[1]};
    const double side = box[1];
    for (int k = 1; k < 4; ++k) box[k] = blend(own_triangle[k], aspect);
    if (!fit_triangle(own_triangle, box)) return kEqual;
    for (int k = 1; k < 4; ++k) box[k] *= side;
  }
  return stored();
}

}  // namespace meshsmooth::detail
