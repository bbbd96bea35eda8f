#pragma once

#include "smooth/base/surroundings.hpp"
#include "smooth/energy/ball_energy.hpp"

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

/// The logarithms of `mean_lengths`.
template <class Get>
MESHSMOOTH_HD BoxLengths log_lengths(const ElementShape& shape, const Get& get) {
  double lengths[4];
  mean_lengths(shape, get, lengths);
  BoxLengths logs{};
  for (int k = 0; k < 4; ++k) logs.of[k] = static_cast<float>(std::log(lengths[k]));
  return logs;
}

/// The `logs` of element `e`, evened out: each becomes the mean, over the element's edges of its
/// direction, of the mean over all elements at that edge. So elements beside each other share the
/// height of their layer, and those on top of each other their width; in a perfect layer nothing
/// changes. `logs[0]` is that of element `first`; elements before are simplices, all others have
/// an edge in common if they have both its nodes.
///
/// cost   O(elements at the edges, at most 512 for each): an axis with more of them has no layers
///        to even out, and each of them would visit all others
MESHSMOOTH_HD inline BoxLengths evened_lengths(const Surroundings& around, std::size_t e,
                                               const BoxLengths* logs, std::size_t first) {
  constexpr std::size_t kLongBall = 512;
  const ElementView element = around.elements[e];
  double sums[4] = {0, 0, 0, 0};
  int counts[4] = {0, 0, 0, 0};
  for (int n = 0; n < element.shape->edge_count; ++n) {
    const int from = element.shape->edges[n][0], to = element.shape->edges[n][1];
    const NodeId a = element.nodes[from], b = element.nodes[to];
    // Both balls have the edge's elements, in the same order.
    const auto row = static_cast<std::size_t>(around.balls.size(static_cast<std::size_t>(b)) <
                                                      around.balls.size(static_cast<std::size_t>(a))
                                                  ? b
                                                  : a);
    if (around.balls.size(row) > kLongBall) continue;
    double sum = 0;
    int count = 0;
    for (const ElementId* f = around.balls.begin(row); f != around.balls.end(row); ++f) {
      if (*f < first) continue;
      const ElementView other = around.elements[*f];
      const NodeId end = row == static_cast<std::size_t>(a) ? b : a;
      int j = 0;
      while (j < other.shape->node_count && other.nodes[j] != end) ++j;
      if (j == other.shape->node_count) continue;
      const int i = local_node(other, static_cast<NodeId>(row));
      const double log = logs[*f - first].of[box_length(*other.shape, i, j)];
      if (!(log > -HUGE_VAL)) continue;
      sum += log;
      ++count;
    }
    if (count == 0) continue;
    const int at = box_length(*element.shape, from, to);
    sums[at] += sum / count;
    ++counts[at];
  }
  BoxLengths result = logs[e - first];
  for (int k = 0; k < 4; ++k) {
    if (counts[k] > 0) result.of[k] = static_cast<float>(sums[k] / counts[k]);
  }
  return result;
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
/// equal edges have too, all of it from `kMeantAspect` on.
template <int kDimension>
inline constexpr double kChanceAspect = kDimension == 3 ? 1.65 : 2;
template <int kDimension>
inline constexpr double kMeantAspect = kDimension == 3 ? 2.1 : 4;
/// How much of its own shape a wedge's triangle keeps: by the same ratio nothing, or all of it.
inline constexpr double kThick = 3;
inline constexpr double kThin = 6;
/// From this quality against its own box on an element has right angles.
inline constexpr double kNearlySquare = 0.9999;
inline constexpr double kSquare = 0.99999;

/// The box that an element without a reference aims at: right angles at an aspect ratio that is
/// meant, as in a boundary layer, else equal edges. That of an element with right angles is its own
/// and meant. Otherwise it is that of the `evened` logarithms of its lengths, and meant where it is
/// larger than in distorted elements of equal edges.
///
/// A perfect layer is then a fixed point: every corner of a hexahedron has its target's shape; the
/// triangles of wedges pull sideways only.
template <int kDimension, class Get>
MESHSMOOTH_HD BoxLengths box_of(const ElementShape& shape, const Get& get, Vec3d reference,
                                const BoxLengths& evened) {
  constexpr BoxLengths kEqual{{1, 1, 1, 1}};
  const bool wedge = shape.node_count == 6;
  double own[4] = {0, 0, 0, 0};
  // Lengths of which the ratio is 1 in the ideal element.
  double lengths[3] = {};
  double longest = 0, shortest = 0, mean = 1;
  const auto compare = [&] {
    // A pyramid's height follows from its base: its own one is the least certain of all lengths.
    if (shape.node_count == 5) own[2] = std::sqrt(own[0] * own[1]);
    lengths[0] = own[0];
    lengths[1] = own[1];
    lengths[2] = kDimension == 3 ? own[2] : own[0];
    if (wedge) lengths[1] = lengths[2] = std::cbrt(own[1] * own[2] * own[3]);
    longest = 0;
    shortest = HUGE_VAL;
    mean = 1;
    for (int m = 0; m < kDimension; ++m) {
      longest = lengths[m] > longest ? lengths[m] : longest;
      shortest = lengths[m] < shortest ? lengths[m] : shortest;
      mean *= lengths[m];
    }
    mean = kDimension == 3 ? std::cbrt(mean) : std::sqrt(mean);
    return shortest > 0 && longest < 1e12 * shortest;
  };
  mean_lengths(shape, get, own);
  if (!compare()) return kEqual;

  double box[4] = {own[0] / mean, own[1] / mean, own[2] / mean, own[3] / mean};
  const auto stored = [&] {
    return BoxLengths{{static_cast<float>(box[0]), static_cast<float>(box[1]),
                       static_cast<float>(box[2]), static_cast<float>(box[3])}};
  };
  const double ratio = least_mean_ratio<kDimension>(
      shape, get, reference, [&](int k) { return box_corner<kDimension>(shape, stored(), k); });
  const double square = smooth_step(kNearlySquare, kSquare, ratio);
  if (square < 1) {
    for (int k = 0; k < 4; ++k)
      own[k] *= blend(std::exp(double{evened.of[k]}) / own[k], 1 - square);
    if (!compare()) return kEqual;
  }
  const double aspect =
      smooth_step(kChanceAspect<kDimension>, kMeantAspect<kDimension>, longest / shortest);
  const double meant = aspect > square ? aspect : square;
  if (meant == 0) return kEqual;
  for (int m = 0; m < kDimension; ++m) box[m] = blend(lengths[m] / mean, meant);
  if (wedge) {
    const double thin = smooth_step(kThick, kThin, longest / shortest);
    const double own_triangle[4] = {1, own[1] / lengths[1], own[2] / lengths[1],
                                    own[3] / lengths[1]};
    const double side = box[1];
    for (int k = 1; k < 4; ++k) box[k] = blend(own_triangle[k], thin);
    if (!fit_triangle(own_triangle, box)) return kEqual;
    for (int k = 1; k < 4; ++k) box[k] *= side;
  }
  return stored();
}

}  // namespace meshsmooth::detail
