#pragma once

#include "meshsmooth/element.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/base/sliding_constraints.hpp"
#include "smooth/base/sweep_stats.hpp"

namespace meshsmooth::detail {

template <Executor E, class Real>
SweepStats measure_moves(E& executor, std::size_t node_count, const Vec3<Real>* before,
                         const Vec3<Real>* after) {
  return executor.reduce(
      node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        return stats_of_move(before[node], after[node], false);
      },
      Plus{});
}

template <Executor E, class Real>
void copy_positions(E& executor, std::size_t node_count, const Vec3<Real>* from, Vec3<Real>* to) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { to[node] = from[node]; });
}

/// Whether a facet at sliding nodes that is right at the positions `before` is not `after`.
template <Executor E, class Real>
[[nodiscard]] bool turns_facets(E& executor, const SlidingConstraints& sliding,
                                const Vec3<Real>* before, const Vec3<Real>* after) {
  if (!sliding.any()) return false;
  return executor.reduce(
             sliding.facet_count, std::int64_t{0},
             [=] MESHSMOOTH_HD(std::size_t f) -> std::int64_t {
               return facet_turns(sliding, f, before, after) ? 1 : 0;
             },
             Plus{}) > 0;
}

/// The caller's positions in internal order.
template <Executor E, class Real>
typename E::template Buffer<Vec3<Real>> positions_in_order(E& executor, const Vec3<Real>* positions,
                                                           const NodeId* caller_ids,
                                                           std::size_t node_count) {
  auto result = executor.template allocate<Vec3<Real>>(node_count);
  Vec3<Real>* const ordered = result.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    ordered[node] = positions[caller_ids[node]];
  });
  return result;
}

}  // namespace meshsmooth::detail
