#pragma once

#include <utility>

#include "smooth/averaging/means.hpp"
#include "smooth/averaging/windowed_sinc.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/energy/mesh_energy.hpp"
#include "smooth/guard/limit_moves.hpp"

namespace meshsmooth::detail {

/// Bytes of `windowed_sinc`: two terms, the input where moves may be limited, `limit_moves`.
[[nodiscard]] inline std::int64_t windowed_sinc_bytes(const MeshCounts& mesh, bool limited,
                                                      bool guarded) {
  return (limited ? 3 : 2) * mesh.nodes * mesh.position_bytes +
         (guarded ? limit_moves_bytes(mesh.nodes, false) : 0);
}

/// One term: `term` is T_k x, `previous` T_{k-1} x and becomes T_{k+1} x; both are x at first,
/// where `share` is 1/2. Adds `factor` times the difference of the terms to the positions.
/// cost   O(ring entries)
/// order  deterministic
template <Executor E, class Real>
SweepStats add_filter_term(E& executor, const Surroundings& around, Real share, Real factor,
                           const Vec3<Real>* term, Vec3<Real>* previous, Vec3<Real>* positions) {
  const QuietPositions<Real> x{term};
  return executor.reduce(
      around.node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] != 0) return SweepStats{};
        const Vec3<Real> own = x[node];
        const Vec3<Real> way =
            (own - previous[node]) + share * (UniformMean{}(around, x, node) - own);
        previous[node] = own + way;
        const Vec3<Real> before = positions[node];
        positions[node] = before + factor * way;
        return stats_of_move(before, positions[node], false);
      },
      Plus{});
}

/// Makes the positions admissible: sliding, within the movement limit, accepted by the guard.
/// Returns how many nodes `limit_moves` held.
template <Executor E, class Real>
std::int64_t admit(E& executor, const SweepContext<E, Real>& context, const Vec3<Real>* input,
                   Vec3<Real>* positions) {
  const Surroundings& around = context.around;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] == 0)
      positions[node] = project(around, displacement_limit, node, positions[node]);
  });
  return context.acceptance.active() ? limit_moves(executor, context, input, positions).held : 0;
}

/// The method WindowedSinc: `WindowedSincFilter` about the centre of the box, fixed nodes as they
/// are. Guard, sliding and movement limit are applied once, to the result.
///
/// takes  positions in internal order
/// gives  the filtered positions in place; after an early end those after the last term
/// cost   O(terms * ring entries); `windowed_sinc_bytes`
/// order  deterministic
template <Executor E, class Real>
void windowed_sinc(E& executor, const SweepContext<E, Real>& context, const WindowedSinc& method,
                   Vec3d centre, ConvergenceMonitor& monitor, Vec3<Real>* positions) {
  const Surroundings& around = context.around;
  const std::size_t node_count = around.node_count;
  const bool limited = context.acceptance.active() || context.displacement_limit.home != nullptr;
  const int term_count = monitor.plan().iteration_limit;
  const WindowedSincFilter filter(method, term_count);
  auto first = executor.template allocate<Vec3<Real>>(node_count);
  auto second = executor.template allocate<Vec3<Real>>(node_count);
  auto given = executor.template allocate<Vec3<Real>>(limited ? node_count : 0);
  Vec3<Real>* term = first.data();
  Vec3<Real>* previous = second.data();
  Vec3<Real>* const input = given.data();
  copy_positions(executor, node_count, positions, term);
  copy_positions(executor, node_count, positions, previous);
  if (limited) copy_positions(executor, node_count, positions, input);
  const double growth = filter.scale() - 1;
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return;
    const Vec3d position = vec3_cast<double>(positions[node]);
    positions[node] = vec3_cast<Real>(position + growth * (position - centre));
  });

  for (int k = 1; k <= term_count; ++k) {
    SweepStats stats =
        add_filter_term(executor, around, static_cast<Real>(k == 1 ? 0.5 : 1),
                        static_cast<Real>(filter.factor(k)), term, previous, positions);
    std::swap(term, previous);
    if (k == term_count) stats.held = admit(executor, context, input, positions);
    if (monitor.keeps_history()) record_energy(executor, around, positions, monitor);
    monitor.record(stats);
    if (k < term_count && monitor.interrupted()) {
      admit(executor, context, input, positions);
      return;
    }
  }
  monitor.end(StopReason::iteration_limit);
}

}  // namespace meshsmooth::detail
