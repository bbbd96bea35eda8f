#pragma once

#include "smooth/steps/positions.hpp"
#include "smooth/steps/sweep_context.hpp"

namespace meshsmooth::detail {

/// Bytes of `limit_moves` for n nodes.
[[nodiscard]] constexpr std::int64_t limit_moves_bytes(std::int64_t n, bool smart) {
  return n * (smart ? 3 + 8 : 3);
}

/// `limit_moves` of a mesh that is known to have tetrahedra alone, or of any.
template <bool kTetrahedra, Executor E, class Real>
std::int64_t limit_moves_of(E& executor, const SweepContext<E, Real>& context,
                            const Vec3<Real>* before, Vec3<Real>* after) {
  const Surroundings& around = context.around;
  const Acceptance acceptance = context.acceptance;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
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

  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    cuts[node] = 0;
    mark[node] = 0;
    changed[node] = before[node] == after[node] ? 0 : 1;
    if (acceptance.smart && changed[node] != 0)
      floor[node] = worst_quality<kTetrahedra>(SingleThread{}, around, old_x, node);
  });
  const auto touched = [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      if (changed[element.nodes[n]] != 0) return true;
    }
    return false;
  };
  const auto mark_if_broken = [=] MESHSMOOTH_HD(std::size_t e) {
    if (quality_of<kTetrahedra>(around, new_x, e) > 0 ||
        !(quality_of<kTetrahedra>(around, old_x, e) > 0))
      return;
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      E::store(mark[element.nodes[n]], std::uint8_t{1});
    }
  };
  // Below this share of changed nodes, visiting their balls costs less than all elements.
  constexpr std::size_t kFew = 16;
  for (bool few_changed = false;;) {
    if (acceptance.guard && few_changed) {
      executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
        if (changed[node] == 0) return;
        for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
          mark_if_broken(*e);
        }
      });
    } else if (acceptance.guard) {
      executor.for_each(around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
        if (touched(e)) mark_if_broken(e);
      });
    }
    if (acceptance.facets) {
      const SlidingConstraints sliding = around.sliding;
      executor.for_each(sliding.facet_count, [=] MESHSMOOTH_HD(std::size_t f) {
        if (!facet_turns(sliding, f, before, after)) return;
        for (const NodeId n : sliding.facets[f].nodes) {
          if (n >= 0) E::store(mark[n], std::uint8_t{1});
        }
      });
    }
    if (acceptance.smart) {
      executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
        if (before[node] == after[node]) return;
        for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
          if (touched(*e) && quality_of<kTetrahedra>(around, new_x, *e) < floor[node]) {
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
          after[node] = ++cuts[node] < kMoveTrials
                            ? part_of_way(around, displacement_limit, node, before[node],
                                          after[node], Real(0.5))
                            : before[node];
          return 1;
        },
        Plus{});
    if (cut == 0) break;
    few_changed = static_cast<std::size_t>(cut) < node_count / kFew;
  }
  return executor.reduce(
      node_count, std::int64_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t { return cuts[node] != 0 ? 1 : 0; },
      Plus{});
}

/// `accept_move` for all nodes of a sweep in which they did not see each other, in rounds:
/// while an element or facet violates the acceptance, the moves of its nodes (guard, facets)
/// or of the node whose ball it worsens (smart) are halved, and undone in the last trial.
/// Terminates, because a sweep with all moves undone is acceptable.
///
/// returns  how many nodes were limited
/// cost     one quality per element in the first round, for smart one per ball entry; few
///          more rounds, which evaluate only what has changed; `limit_moves_bytes`
/// order    deterministic
/// tests    smoother_oracle_test compares with the oracle's node by node version
template <Executor E, class Real>
std::int64_t limit_moves(E& executor, const SweepContext<E, Real>& context,
                         const Vec3<Real>* before, Vec3<Real>* after) {
  return context.around.elements.tetrahedra
             ? limit_moves_of<true>(executor, context, before, after)
             : limit_moves_of<false>(executor, context, before, after);
}

/// `limit_moves`, then the statistics of what remains of the sweep.
template <Executor E, class Real>
SweepStats limit_and_measure(E& executor, const SweepContext<E, Real>& context,
                             const Vec3<Real>* before, Vec3<Real>* after) {
  const std::int64_t held = limit_moves(executor, context, before, after);
  SweepStats stats = measure_moves(executor, context.around.node_count, before, after);
  stats.held = held;
  return stats;
}

}  // namespace meshsmooth::detail
