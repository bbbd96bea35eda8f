#pragma once

#include "smooth/base/colouring_rule.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/cpu/tetrahedron_terms.hpp"
#include "smooth/optimize/optimize_sweeper.hpp"
#include "smooth/optimize/phase_monitor.hpp"

namespace meshsmooth::detail {

/// `optimize_node` of a node whose `TetrahedronTerms` fit.
template <bool kReference, class P>
Visit<typename P::Real> optimize_tetrahedra(
    const Surroundings& around, const P& x, std::size_t node, const OptimizePhase& phase,
    const DisplacementLimit<typename P::Real>& displacement_limit) {
  return run_wide([&] {
    const SingleThread thread;
    using Terms = TetrahedronTerms<P, kReference>;
    Terms terms(around, x, node);
    return NodeOptimizer<3, true, SingleThread, Terms>(thread, around, terms, node, {0, 0, 0},
                                                       phase, displacement_limit)
        .visit();
  });
}

/// One visit of every free node that is awake (`VisitState`): in place, colour by colour.
///
/// cost   two to four passes over each ball
/// order  deterministic
template <int kDimension, class Real>
OptimizeStats sweep_optimize(CpuExecutor& executor, OptimizeSweeper<CpuExecutor, Real>& sweeper,
                             const OptimizePhase& phase) {
  constexpr int kStoredCorners = 96;  // of a ball; those of larger ones are computed again
  const Surroundings& around = sweeper.around();
  const DisplacementLimit<Real> displacement_limit = sweeper.displacement_limit();
  std::uint8_t* const states = sweeper.states();
  Vec3<Real>* const positions = sweeper.positions();
  const QuietPositions<Real> x{positions};
  const auto visit_node = [=](std::size_t node) {
    if ((states[node] & kAwake) == 0) return stats_asleep(states[node]);
    const Vec3<Real> before = x[node];
    using P = QuietPositions<Real>;
    const Visit<Real> visit =
        kDimension == 3 && TetrahedronTerms<P, false>::fit(around, node)
            ? optimize_tetrahedra<false>(around, x, node, phase, displacement_limit)
        : kDimension == 3 && TetrahedronTerms<P, true>::fit(around, node)
            ? optimize_tetrahedra<true>(around, x, node, phase, displacement_limit)
            : optimize_node<kDimension, kStoredCorners>(SingleThread{}, around, x, node, phase,
                                                        displacement_limit);
    states[node] = state_after(before, visit);
    if (!(visit.position == before)) {
      positions[node] = visit.position;
      visit_adjacent(around, node, [&](NodeId other) {
        if (static_cast<std::size_t>(other) != node) {
          CpuExecutor::store(states[other], std::uint8_t{kAwake});
        }
        return true;
      });
    }
    return stats_of_visit(before, visit);
  };
  return reduce_by_colour<OptimizeStats>(executor, sweeper.colouring(), visit_node,
                                         Lookahead<Real>{around, positions, true});
}

/// The sweeps of one phase, until its monitor reports the end.
template <class Real>
void run_phase(CpuExecutor& executor, OptimizeSweeper<CpuExecutor, Real>& sweeper,
               const OptimizePhase& phase, PhaseMonitor& monitor) {
  for (bool done = false; !done;) {
    const OptimizeStats stats = sweeper.surface() ? sweep_optimize<2>(executor, sweeper, phase)
                                                  : sweep_optimize<3>(executor, sweeper, phase);
    if (monitor.needs_energy()) {
      const MeshEnergy energy = sweeper.measure(phase.power);
      done = monitor.done(stats, &energy);
    } else {
      done = monitor.done(stats, nullptr);
    }
  }
}

/// `Surroundings::opposite` of a mesh of tetrahedra; empty for others.
/// cost   O(ball entries), `opposite_bytes`
inline CpuBuffer<NodeId> find_opposite_nodes(CpuExecutor& executor, const Surroundings& around) {
  const ElementShape& shape = *around.elements.runs[0].shape;
  if (around.elements.run_count != 1 || shape.dimension != 3 || shape.node_count != 4) return {};
  auto opposite = executor.allocate<NodeId>(3 * 4 * around.elements.count);
  NodeId* const out = opposite.data();
  executor.for_each(around.node_count, [=](std::size_t node) {
    for (std::int64_t e = around.balls.offsets[node]; e < around.balls.offsets[node + 1]; ++e) {
      const ElementView element = around.elements[around.balls.entries[e]];
      const int own = local_node(element, static_cast<NodeId>(node));
      for (int m = 0; m < 3; ++m) {
        out[3 * e + m] = element.nodes[element.shape->corners[own].neighbours[m]];
      }
    }
  });
  return opposite;
}

}  // namespace meshsmooth::detail
