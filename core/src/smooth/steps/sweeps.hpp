#pragma once

#include "smooth/rules/rules.hpp"
#include "smooth/steps/colouring.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// What one sweep did.
struct SweepStats {
  double max_squared = 0;  // largest squared move
  double sum_squared = 0;
  std::int64_t moved = 0;
  std::int64_t held = 0;

  friend MESHSMOOTH_HD SweepStats operator+(const SweepStats& a, const SweepStats& b) {
    return {a.max_squared > b.max_squared ? a.max_squared : b.max_squared,
            a.sum_squared + b.sum_squared, a.moved + b.moved, a.held + b.held};
  }
};

struct AddStats {
  MESHSMOOTH_HD SweepStats operator()(const SweepStats& a, const SweepStats& b) const {
    return a + b;
  }
};

template <class Real>
MESHSMOOTH_HD SweepStats stats_of_move(Vec3<Real> before, Vec3<Real> after, bool held) {
  const Vec3d move = vec3_cast<double>(after) - vec3_cast<double>(before);
  const double squared = dot(move, move);
  return {squared, squared, before == after ? 0 : 1, held ? 1 : 0};
}

template <Executor E, class Real>
SweepStats measure_moves(E& executor, std::size_t node_count, const Vec3<Real>* before,
                         const Vec3<Real>* after) {
  return executor.reduce(
      node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        return stats_of_move(before[node], after[node], false);
      },
      AddStats{});
}

template <Executor E, class Real>
void copy_positions(E& executor, std::size_t node_count, const Vec3<Real>* from, Vec3<Real>* to) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { to[node] = from[node]; });
}

/// Positions in internal order.
template <Executor E, class Real>
typename E::template Buffer<Vec3<Real>> places_of(E& executor, const Vec3<Real>* positions,
                                                  const NodeId* caller_ids,
                                                  std::size_t node_count) {
  auto result = executor.template allocate<Vec3<Real>>(node_count);
  Vec3<Real>* const places = result.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    places[node] = positions[caller_ids[node]];
  });
  return result;
}

/// Cuts back the moves of a sweep in which nodes did not see each other: while
/// an element or facet breaks the acceptance, the moves of its nodes (guard, facets) or of
/// the node whose ball it worsens (smart) are halved, the fourth time taken back.
/// Ends, because a sweep all taken back is acceptable. Returns how many nodes
/// were held.
///
/// cost   a score per element in the first round, for smart one per ball entry; few
///        more rounds, in which only what has changed is looked at; 3 B a node, for
///        smart 11 B
/// order  deterministic
template <Executor E, class Real>
std::int64_t limit_moves(E& executor, const Surroundings& around, Acceptance acceptance,
                         const Vec3<Real>* before, Vec3<Real>* after,
                         DisplacementLimit<Real> displacement_limit = {}) {
  constexpr std::uint8_t kMostCuts = 4;
  const std::size_t node_count = around.node_count;
  auto cut_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto mark_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto changed_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto floor_buffer = executor.template allocate<double>(acceptance.smart ? node_count : 0);
  std::uint8_t* const cuts = cut_buffer.data();
  std::uint8_t* const mark = mark_buffer.data();
  std::uint8_t* const changed = changed_buffer.data();
  double* const floor = floor_buffer.data();
  const QuietPositions<Real> old_x{before};
  const QuietPositions<Real> new_x{after};
  const auto add = [] MESHSMOOTH_HD(std::int64_t a, std::int64_t b) { return a + b; };

  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    cuts[node] = 0;
    mark[node] = 0;
    changed[node] = before[node] == after[node] ? 0 : 1;
    if (acceptance.smart && changed[node] != 0)
      floor[node] = worst_quality(SingleThread{}, around, old_x, node);
  });
  const auto touched = [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      if (changed[element.nodes[n]] != 0) return true;
    }
    return false;
  };
  const auto mark_if_spoilt = [=] MESHSMOOTH_HD(std::size_t e) {
    if (quality_of(around, new_x, e) > 0 || !(quality_of(around, old_x, e) > 0)) return;
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      E::store(mark[element.nodes[n]], std::uint8_t{1});
    }
  };
  constexpr std::size_t kFew = 16;  // then each of their elements once more costs less than all
  for (bool few_changed = false;;) {
    if (acceptance.guard && few_changed) {
      executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
        if (changed[node] == 0) return;
        for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
          mark_if_spoilt(*e);
        }
      });
    } else if (acceptance.guard) {
      executor.for_each(around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
        if (touched(e)) mark_if_spoilt(e);
      });
    }
    if (acceptance.facets) {
      const SlidingConstraints sliding = around.sliding;
      executor.for_each(sliding.facet_count, [=] MESHSMOOTH_HD(std::size_t f) {
        const ConstrainedFacet& facet = sliding.facets[f];
        const auto lies = [=](const Vec3<Real>* x) {
          return facet_is_right(facet, sliding.curved,
                                [=](NodeId n) { return vec3_cast<double>(x[n]); });
        };
        if (lies(after) || !lies(before)) return;
        for (const NodeId n : facet.nodes) {
          if (n >= 0) E::store(mark[n], std::uint8_t{1});
        }
      });
    }
    if (acceptance.smart) {
      executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
        if (before[node] == after[node]) return;
        for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
          if (touched(*e) && quality_of(around, new_x, *e) < floor[node]) {
            mark[node] = 1;
            return;
          }
        }
      });
    }
    const std::int64_t cut = executor.reduce(
        node_count, std::int64_t{0},
        [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
          const bool bad = mark[node] != 0 && !(before[node] == after[node]);
          mark[node] = 0;
          changed[node] = bad ? 1 : 0;
          if (!bad) return 0;
          after[node] = ++cuts[node] < kMostCuts ? part_of_way(around, displacement_limit, node,
                                                               before[node], after[node], Real(0.5))
                                                 : before[node];
          return 1;
        },
        add);
    if (cut == 0) break;
    few_changed = static_cast<std::size_t>(cut) < node_count / kFew;
  }
  return executor.reduce(
      node_count, std::int64_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t { return cuts[node] != 0 ? 1 : 0; }, add);
}

/// `limit_moves`, and what is left of the sweep.
template <Executor E, class Real>
SweepStats limit_and_measure(E& executor, const Surroundings& around, Acceptance acceptance,
                             const Vec3<Real>* before, Vec3<Real>* after,
                             DisplacementLimit<Real> displacement_limit) {
  const std::int64_t held =
      limit_moves(executor, around, acceptance, before, after, displacement_limit);
  SweepStats stats = measure_moves(executor, around.node_count, before, after);
  stats.held = held;
  return stats;
}

/// Form A: reads `before`, writes `after`; they agree on fixed nodes.
/// cost   O(ring entries); when the acceptance is active also limit_moves
template <Executor E, class Mean, class Real>
SweepStats sweep_jacobi(E& executor, const Surroundings& around, const Mean& mean, Real factor,
                        Acceptance acceptance, const Vec3<Real>* before, Vec3<Real>* after,
                        DisplacementLimit<Real> displacement_limit = {}) {
  const QuietPositions<Real> x{before};
  const SweepStats stats = executor.reduce(
      around.node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] != 0) return SweepStats{};
        after[node] =
            hold(around, displacement_limit, node, step_towards(mean, around, x, node, factor));
        return stats_of_move(before[node], after[node], false);
      },
      AddStats{});
  if (!acceptance.active()) return stats;
  return limit_and_measure(executor, around, acceptance, before, after, displacement_limit);
}

/// Where a node goes that moves alone.
template <class Team, class Mean, class P>
MESHSMOOTH_HD Vec3<typename P::Real> move_node(
    const Team& team, const Surroundings& around, const P& x, std::size_t node, const Mean& mean,
    typename P::Real factor, Acceptance acceptance, bool& held,
    DisplacementLimit<typename P::Real> displacement_limit = {}) {
  Vec3<typename P::Real> place = step_towards(mean, around, x, node, factor);
  // A device does not hold code for nodes that slide where it knows that none does.
  if (acceptance.facets || displacement_limit.home != nullptr)
    place = hold(around, displacement_limit, node, place);
  return acceptance.active()
             ? accept_move(team, around, x, node, place, acceptance, held, displacement_limit)
             : place;
}

/// Form B, deterministic: in place, colour by colour.
template <Executor E, class Mean, class Real>
SweepStats sweep_gauss_seidel(E& executor, const Surroundings& around,
                              const Colouring<E>& colouring, const Mean& mean, Real factor,
                              Acceptance acceptance, Vec3<Real>* positions,
                              DisplacementLimit<Real> displacement_limit = {}) {
  const QuietPositions<Real> x{positions};
  SweepStats stats;
  for (std::size_t c = 0; c < colouring.count(); ++c) {
    const NodeId* const nodes = colouring.nodes.data() + colouring.first[c];
    stats = stats + executor.reduce(
                        colouring.first[c + 1] - colouring.first[c], SweepStats{},
                        [=] MESHSMOOTH_HD(std::size_t n) {
                          const auto node = static_cast<std::size_t>(nodes[n]);
                          bool held = false;
                          const Vec3<Real> before = x[node];
                          const Vec3<Real> place =
                              move_node(SingleThread{}, around, x, node, mean, factor, acceptance,
                                        held, displacement_limit);
                          positions[node] = place;
                          return stats_of_move(before, place, held);
                        },
                        AddStats{});
  }
  return stats;
}

/// Form B as in the paper: in place, every node as it comes. Not deterministic.
/// `before` keeps the positions of the sweep's start when the acceptance is
/// active, which judges the sweep as a whole.
template <Executor E, class Mean, class Real>
SweepStats sweep_asynchronous(E& executor, const Surroundings& around, const Mean& mean,
                              Real factor, Acceptance acceptance, Vec3<Real>* before,
                              Vec3<Real>* positions,
                              DisplacementLimit<Real> displacement_limit = {}) {
  if (acceptance.active()) {
    executor.for_each(around.node_count,
                      [=] MESHSMOOTH_HD(std::size_t node) { before[node] = positions[node]; });
  }
  const typename E::template AsynchronousPositions<Real> x{positions};
  const SweepStats stats = executor.reduce(
      around.node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] != 0) return SweepStats{};
        const Vec3<Real> old_place = x[node];
        const Vec3<Real> place =
            hold(around, displacement_limit, node, step_towards(mean, around, x, node, factor));
        x.store(node, place);
        return stats_of_move(old_place, place, false);
      },
      AddStats{});
  if (!acceptance.active()) return stats;
  return limit_and_measure<E, Real>(executor, around, acceptance, before, positions,
                                    displacement_limit);
}

/// One HC sweep, form A. `original` are the input positions, `differences` is
/// scratch of node_count. Source: Vollmer et al. 1999, section 4: p = mean(q);
/// b = p - (alpha o + (1 - alpha) q); p -= beta b + (1 - beta) mean(b).
template <Executor E, class Real>
SweepStats sweep_hc(E& executor, const Surroundings& around, Real alpha, Real beta,
                    Acceptance acceptance, const Vec3<Real>* original, const Vec3<Real>* before,
                    Vec3<Real>* after, Vec3<Real>* differences,
                    DisplacementLimit<Real> displacement_limit = {}) {
  const QuietPositions<Real> x{before};
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const bool fixed = around.fixed[node] != 0;
    const Vec3<Real> mean = fixed ? before[node] : UniformMean{}(around, x, node);
    differences[node] = mean - (alpha * original[node] + (1 - alpha) * before[node]);
    if (!fixed) after[node] = mean;
  });
  const QuietPositions<Real> b{differences};
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return;
    after[node] = hold(
        around, displacement_limit, node,
        after[node] - (beta * differences[node] + (1 - beta) * UniformMean{}(around, b, node)));
  });
  if (!acceptance.active()) return measure_moves(executor, around.node_count, before, after);
  return limit_and_measure(executor, around, acceptance, before, after, displacement_limit);
}

}  // namespace meshsmooth::detail
