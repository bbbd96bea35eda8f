#pragma once

#include "meshsmooth/methods.hpp"
#include "meshsmooth/quality.hpp"
#include "smooth/constraints/closest_point.hpp"
#include "smooth/constraints/sliding_constraints.hpp"
#include "smooth/rules/element_quality.hpp"
#include "smooth/rules/topology.hpp"

namespace meshsmooth::detail {

/// Everything around the nodes of a job that does not move, in executor memory.
struct Surroundings {
  std::size_t node_count;
  Elements elements;
  Rows<NodeId> rings;
  Rows<ElementId> balls;              // only where a method or the guard needs them
  const std::uint8_t* fixed;          // one byte a node
  const PackedDirection* references;  // a normal per surface element; null: all have `reference`
  Vec3d reference;
  // Of a mesh of tetrahedra, for Optimize: beside each entry of the balls the three other
  // nodes, in the order of the corner's edges.
  const NodeId* opposite = nullptr;
  SlidingConstraints sliding{};

  [[nodiscard]] MESHSMOOTH_HD Vec3d reference_of(std::size_t element) const {
    return references == nullptr ? reference : unpack_direction(references[element]);
  }
  [[nodiscard]] bool surface() const {
    return references != nullptr || dot(reference, reference) > 0;
  }
};

/// Reads positions that nobody writes, or only nodes of another colour.
template <class R>
struct QuietPositions {
  using Real = R;
  const Vec3<R>* data;
  [[nodiscard]] MESHSMOOTH_HD Vec3<R> operator[](std::size_t node) const { return data[node]; }
};

// The rules: where the weighted mean of a node's surroundings lies. `mean`
// returns the node's own position when there is nothing to average. Sums run in
// the rows' order, which is the caller's.

/// The mean of the positions of some nodes; that of `node` when there are none.
template <class P>
MESHSMOOTH_HD Vec3<typename P::Real> mean_of(const P& x, const NodeId* begin, const NodeId* end,
                                             std::size_t node) {
  using Real = typename P::Real;
  if (begin == end) return x[node];
  Vec3<Real> sum{0, 0, 0};
  MESHSMOOTH_UNROLL(8)
  for (const NodeId* n = begin; n != end; ++n) sum += x[static_cast<std::size_t>(*n)];
  const auto count = static_cast<Real>(end - begin);
  return {sum.x / count, sum.y / count, sum.z / count};
}

/// x' = sum_j x_j / |ring|. Source: Xiao et al. 2019, eq. 1.
struct UniformMean {
  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    return mean_of(x, around.rings.begin(node), around.rings.end(node), node);
  }
};

/// x' = sum_j w_j x_j / sum_j w_j with w = length^Power; edges of length zero
/// carry no weight.
template <int Power>
struct EdgeLengthMean {
  static_assert(Power == 1 || Power == -1);
  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    using Real = typename P::Real;
    const Vec3<Real> own = x[node];
    Vec3<Real> sum{0, 0, 0};
    Real weights = 0;
    for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
      const Vec3<Real> edge = x[static_cast<std::size_t>(*n)] - own;
      const Real length = norm(edge);
      if (!(length > 0)) continue;
      const Real weight = Power == 1 ? length : 1 / length;
      sum += weight * edge;
      weights += weight;
    }
    return weights > 0 ? own + (1 / weights) * sum : own;
  }
};

/// x' = sum_e V_e c_e / sum_e V_e over the ball's elements, c_e the mean of an
/// element's nodes.
struct BallVolumeMean {
  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    using Real = typename P::Real;
    const Vec3d own = vec3_cast<double>(x[node]);
    Vec3d sum{0, 0, 0};
    double weights = 0;
    for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
      const ElementView element = around.elements[*e];
      const ElementMass mass = element_mass(*element.shape, [&](int n) {
        return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]) - own;
      });
      sum += mass.volume * mass.centre;
      weights += mass.volume;
    }
    return weights > 0 ? vec3_cast<Real>(own + (1 / weights) * sum) : x[node];
  }
};

/// One relaxed step towards a goal. A node at rest stays, and factor 1 lands on the
/// goal exactly.
template <class Real>
MESHSMOOTH_HD Vec3<Real> step_to(Vec3<Real> goal, Vec3<Real> own, Real factor) {
  return factor == 1 ? goal : own + factor * (goal - own);
}

/// `step_to` the mean.
template <class Mean, class P>
MESHSMOOTH_HD Vec3<typename P::Real> step_towards(const Mean& mean, const Surroundings& around,
                                                  const P& x, std::size_t node,
                                                  typename P::Real factor) {
  return step_to(mean(around, x, node), x[node], factor);
}

/// How far a node may go: at most `limit` from where the caller had it. No displacement_limit
/// without `home`.
template <class Real>
struct DisplacementLimit {
  const Vec3<Real>* home = nullptr;
  double limit = 0;

  /// The place, drawn back towards home where it is too far, to the rounding of the
  /// coordinates.
  [[nodiscard]] MESHSMOOTH_HD Vec3<Real> hold(std::size_t node, Vec3<Real> place) const {
    if (home == nullptr) return place;
    const Vec3d from = vec3_cast<double>(home[node]);
    const Vec3d way = vec3_cast<double>(place) - from;
    const double length = norm(way);
    return length <= limit ? place : vec3_cast<Real>(from + (limit / length) * way);
  }
};

/// The place nearest to `place` that a node of curved parts may take, on its displacement_limit
/// too: drawn back and projected in turns, home if that does not end.
template <class Real>
MESHSMOOTH_OUTLINE MESHSMOOTH_HD Vec3<Real> hold_on_facets(
    const SlidingConstraints& sliding, const DisplacementLimit<Real>& displacement_limit,
    std::size_t node, Vec3<Real> place) {
  constexpr int kMostTurns = 4;
  const Vec3d home = sliding.home(static_cast<NodeId>(node));
  for (int turn = 0; turn < kMostTurns; ++turn) {
    place = vec3_cast<Real>(project(sliding, node, vec3_cast<double>(place)));
    if (displacement_limit.home == nullptr) return place;
    const Vec3d way = vec3_cast<double>(place) - home;
    const double length = norm(way);
    if (length <= displacement_limit.limit) return place;
    place = vec3_cast<Real>(home + (0.999 * displacement_limit.limit / length) * way);
  }
  return vec3_cast<Real>(home);
}

/// The place nearest to `place` that the node may take: on its plane or line, or on the
/// facets as they came, and on its displacement_limit.
template <class Real>
MESHSMOOTH_HD Vec3<Real> hold(const Surroundings& around,
                              const DisplacementLimit<Real>& displacement_limit, std::size_t node,
                              Vec3<Real> place) {
  const NodeConstraint* const constraint = around.sliding.constraint(node);
  if (constraint == nullptr) return displacement_limit.hold(node, place);
  if (constraint->curved()) return hold_on_facets(around.sliding, displacement_limit, node, place);
  return displacement_limit.hold(node, slide_to(*constraint, place));
}

/// The place after a share of the way between two that the node may take.
template <class Real>
MESHSMOOTH_HD Vec3<Real> part_of_way(const Surroundings& around,
                                     const DisplacementLimit<Real>& displacement_limit,
                                     std::size_t node, Vec3<Real> from, Vec3<Real> to, Real share) {
  const Vec3<Real> place = from + share * (to - from);
  if (!around.sliding.curved) return place;
  const NodeConstraint* const constraint = around.sliding.constraint(node);
  const bool curved = constraint != nullptr && constraint->curved();
  return curved ? hold_on_facets(around.sliding, displacement_limit, node, place) : place;
}

/// Which moves are taken. Judged in double on the positions as they are stored.
struct Acceptance {
  bool guard = false;   // a valid element stays valid
  bool smart = false;   // the worst score of the ball does not fall
  bool facets = false;  // the facets around sliding nodes stay right

  [[nodiscard]] MESHSMOOTH_HD bool active() const { return guard || smart || facets; }
};

/// Score of an element as it lies.
template <class P>
MESHSMOOTH_HD double quality_of(const Surroundings& around, const P& x, std::size_t e) {
  const ElementView element = around.elements[e];
  return element_quality(
      *element.shape,
      [&](int n) { return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]); },
      around.reference_of(e));
}

/// Score of an element when `node` lies at `place`.
template <class P>
MESHSMOOTH_HD double quality_with(const Surroundings& around, const P& x, ElementId e,
                                  std::size_t node, Vec3<typename P::Real> place) {
  const ElementView element = around.elements[e];
  return element_quality(
      *element.shape,
      [&](int n) {
        const auto other = static_cast<std::size_t>(element.nodes[n]);
        return vec3_cast<double>(other == node ? place : x[other]);
      },
      around.reference_of(e));
}

/// Threads that judge one node's ball together: each takes every `size`-th element
/// from `rank` on, and all learn what they found.
struct SingleThread {
  static constexpr int size = 1;
  static constexpr int rank = 0;
  [[nodiscard]] MESHSMOOTH_HD double lowest(double value) const { return value; }
  [[nodiscard]] MESHSMOOTH_HD double sum(double value) const { return value; }
  [[nodiscard]] MESHSMOOTH_HD bool all(bool value) const { return value; }
};

template <class Team, class P>
MESHSMOOTH_HD double worst_quality(const Team& team, const Surroundings& around, const P& x,
                                   std::size_t node) {
  double worst = 2.0;
  const ElementId* const end = around.balls.end(node);
  for (const ElementId* e = around.balls.begin(node) + team.rank; e < end; e += team.size) {
    const double score = quality_of(around, x, *e);
    if (score < worst) worst = score;
  }
  return team.lowest(worst);
}

/// Cuts a move back until it is acceptable: the whole step, a half, a quarter,
/// an eighth, or none. `held` becomes true unless the whole step is taken.
template <class Team, class P>
MESHSMOOTH_HD Vec3<typename P::Real> accept_move(
    const Team& team, const Surroundings& around, const P& x, std::size_t node,
    Vec3<typename P::Real> candidate, Acceptance acceptance, bool& held,
    DisplacementLimit<typename P::Real> displacement_limit = {}) {
  using Real = typename P::Real;
  const Vec3<Real> before = x[node];
  if (candidate == before) return before;
  const double worst = acceptance.smart ? worst_quality(team, around, x, node) : 0.0;
  const auto allowed = [&](Vec3<Real> place) {
    if (acceptance.facets && !keeps_facets(team, around.sliding, x, node, place)) return false;
    bool right = true;
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node) + team.rank; right && e < end;
         e += team.size) {
      const double score = quality_with(around, x, *e, node, place);
      right = !(acceptance.smart && score < worst) &&
              !(acceptance.guard && !(score > 0) && quality_with(around, x, *e, node, before) > 0);
    }
    return team.all(right);
  };
  Real share = 1;
  for (int trial = 0; trial < 4; ++trial) {
    const Vec3<Real> place = trial == 0          ? candidate
                             : acceptance.facets ? part_of_way(around, displacement_limit, node,
                                                               before, candidate, share)
                                                 : before + share * (candidate - before);
    if (allowed(place)) return place;
    held = true;
    share /= 2;
  }
  return before;
}

}  // namespace meshsmooth::detail
