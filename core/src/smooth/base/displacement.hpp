#pragma once

#include "smooth/base/closest_point.hpp"
#include "smooth/base/surroundings.hpp"

namespace meshsmooth::detail {

/// How far a node may move: at most `limit` from its input position. Unlimited without `home`.
template <class Real>
struct DisplacementLimit {
  const Vec3<Real>* home = nullptr;
  double limit = 0;

  /// The position, pulled back towards home where it is too far, up to the rounding of the
  /// coordinates.
  [[nodiscard]] MESHSMOOTH_HD Vec3<Real> clamp(std::size_t node, Vec3<Real> position) const {
    if (home == nullptr) return position;
    const Vec3d from = vec3_cast<double>(home[node]);
    const Vec3d way = vec3_cast<double>(position) - from;
    const double length = norm(way);
    return length <= limit ? position : vec3_cast<Real>(from + (limit / length) * way);
  }
};

/// The nearest admissible position of a node on a curved part, within its displacement limit
/// too: pulled back and projected alternately; home if that does not converge.
template <class Real>
MESHSMOOTH_OUTLINE MESHSMOOTH_HD Vec3<Real> project_to_facets(
    const SlidingConstraints& sliding, const DisplacementLimit<Real>& displacement_limit,
    std::size_t node, Vec3<Real> position) {
  constexpr int kMostTurns = 4;
  const Vec3d home = sliding.home(static_cast<NodeId>(node));
  for (int turn = 0; turn < kMostTurns; ++turn) {
    position = vec3_cast<Real>(project(sliding, node, vec3_cast<double>(position)));
    if (displacement_limit.home == nullptr) return position;
    const Vec3d way = vec3_cast<double>(position) - home;
    const double length = norm(way);
    if (length <= displacement_limit.limit) return position;
    position = vec3_cast<Real>(home + (0.999 * displacement_limit.limit / length) * way);
  }
  return vec3_cast<Real>(home);
}

/// The nearest admissible position: on the node's plane or line, or on the input facets, and
/// within its displacement limit.
template <class Real>
MESHSMOOTH_HD Vec3<Real> project(const Surroundings& around,
                                 const DisplacementLimit<Real>& displacement_limit,
                                 std::size_t node, Vec3<Real> position) {
  const NodeConstraint* const constraint = around.sliding.constraint(node);
  if (constraint == nullptr) return displacement_limit.clamp(node, position);
  if (constraint->curved())
    return project_to_facets(around.sliding, displacement_limit, node, position);
  return displacement_limit.clamp(node, slide_to(*constraint, position));
}

/// The admissible position after a share of the way between two.
template <class Real>
MESHSMOOTH_HD Vec3<Real> part_of_way(const Surroundings& around,
                                     const DisplacementLimit<Real>& displacement_limit,
                                     std::size_t node, Vec3<Real> from, Vec3<Real> to, Real share) {
  const Vec3<Real> position = from + share * (to - from);
  if (!around.sliding.curved) return position;
  const NodeConstraint* const constraint = around.sliding.constraint(node);
  const bool curved = constraint != nullptr && constraint->curved();
  return curved ? project_to_facets(around.sliding, displacement_limit, node, position) : position;
}

}  // namespace meshsmooth::detail
