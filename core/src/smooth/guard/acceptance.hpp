#pragma once

#include "smooth/base/displacement.hpp"
#include "smooth/base/element_quality.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Which moves are accepted, and how far nodes may go.
template <class Real>
struct MoveRule {
  Acceptance acceptance = {};
  DisplacementLimit<Real> displacement_limit = {};
};

/// `element_quality` of an element at the positions `x`.
template <bool kTetrahedra = false, class P>
MESHSMOOTH_HD double quality_of(const Surroundings& around, const P& x, std::size_t e) {
  const ElementView element = around.elements.get<kTetrahedra>(e);
  return element_quality<kTetrahedra>(
      *element.shape,
      [&](int n) { return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]); },
      around.reference_of(e));
}

/// Whether `quality_of` is above 0.
template <bool kTetrahedra, class P>
MESHSMOOTH_HD bool is_positive(const Surroundings& around, const P& x, std::size_t e) {
  if constexpr (!kTetrahedra) return quality_of(around, x, e) > 0;
  const ElementView element = around.elements.get<true>(e);
  const auto get = [&](int n) {
    return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]);
  };
  return tetrahedron_is_positive(get(0), get(1), get(2), get(3));
}

/// `element_quality` of an element with `node` moved to `position`.
template <bool kTetrahedra = false, class P>
MESHSMOOTH_HD double quality_with(const Surroundings& around, const P& x, ElementId e,
                                  std::size_t node, Vec3<typename P::Real> position) {
  const ElementView element = around.elements.get<kTetrahedra>(e);
  return element_quality<kTetrahedra>(
      *element.shape,
      [&](int n) {
        const auto other = static_cast<std::size_t>(element.nodes[n]);
        return vec3_cast<double>(other == node ? position : x[other]);
      },
      around.reference_of(e));
}

template <bool kTetrahedra = false, class Team, class P>
MESHSMOOTH_HD double worst_quality(const Team& team, const Surroundings& around, const P& x,
                                   std::size_t node) {
  double worst = 2.0;
  const ElementId* const end = around.balls.end(node);
  for (const ElementId* e = around.balls.begin(node) + team.rank; e < end; e += team.size) {
    const double quality = quality_of<kTetrahedra>(around, x, *e);
    if (quality < worst) worst = quality;
  }
  return team.lowest(worst);
}

/// Trials of a move: the whole step, a half, a quarter, an eighth; then none.
inline constexpr int kMoveTrials = 4;

/// The end of a straight move that is halved `cuts` times, or undone by the last trial.
template <class Real>
MESHSMOOTH_HD Vec3<Real> cut_move(Vec3<Real> before, Vec3<Real> after, int cuts) {
  if (cuts >= kMoveTrials) return before;
  for (; cuts > 0; --cuts) after = before + Real(0.5) * (after - before);
  return after;
}

/// Whether the acceptance admits an element that a move gives this quality; `worst` is that of the
/// ball before it, `before()` the element's own.
template <class Before>
MESHSMOOTH_HD bool is_allowed(Acceptance acceptance, double quality, double worst,
                              const Before& before) {
  return !(acceptance.smart && quality < worst) &&
         !(acceptance.guard && !(quality > 0) && before() > 0);
}

/// The first trial of a move that is `allowed(position)`, or `before`.
template <class Real, class Allowed>
MESHSMOOTH_HD Vec3<Real> first_allowed(const Surroundings& around, std::size_t node,
                                       Vec3<Real> before, Vec3<Real> candidate,
                                       const MoveRule<Real>& rule, bool& held,
                                       const Allowed& allowed) {
  Real share = 1;
  for (int trial = 0; trial < kMoveTrials; ++trial) {
    const Vec3<Real> position =
        trial == 0 ? candidate
        : rule.acceptance.facets
            ? part_of_way(around, rule.displacement_limit, node, before, candidate, share)
            : before + share * (candidate - before);
    if (allowed(position)) return position;
    held = true;
    share /= 2;
  }
  return before;
}

/// Cuts a move back until it is acceptable, in `kMoveTrials`. `held` becomes true unless the
/// whole step is taken. Reference of three faster versions: `limit_moves` for all nodes of a sweep
/// at once, and the CPU's and a CUDA team's, which read a ball of tetrahedra once for all trials
/// (compared by cpu_balls_test and tests/gpu/parity_test).
template <bool kTetrahedra = false, class Team, class P>
MESHSMOOTH_HD Vec3<typename P::Real> accept_move(const Team& team, const Surroundings& around,
                                                 const P& x, std::size_t node,
                                                 Vec3<typename P::Real> candidate,
                                                 const MoveRule<typename P::Real>& rule,
                                                 bool& held) {
  using Real = typename P::Real;
  const Acceptance acceptance = rule.acceptance;
  const Vec3<Real> before = x[node];
  if (candidate == before) return before;
  const double worst = acceptance.smart ? worst_quality<kTetrahedra>(team, around, x, node) : 0.0;
  const auto allowed = [&](Vec3<Real> position) {
    if (acceptance.facets && !keeps_facets(team, around.sliding, x, node, position)) return false;
    bool accepted = true;
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node) + team.rank; accepted && e < end;
         e += team.size) {
      accepted =
          is_allowed(acceptance, quality_with<kTetrahedra>(around, x, *e, node, position), worst,
                     [&] { return quality_with<kTetrahedra>(around, x, *e, node, before); });
    }
    return team.all(accepted);
  };
  return first_allowed(around, node, before, candidate, rule, held, allowed);
}

}  // namespace meshsmooth::detail
