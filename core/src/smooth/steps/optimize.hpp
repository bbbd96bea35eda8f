#pragma once

#include "smooth/steps/backend.hpp"
#include "smooth/steps/limit_moves.hpp"
#include "smooth/steps/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Balls with a worst mean ratio below are refined when no target is given.
inline constexpr double kPoorMeanRatio = 0.5;
/// The refinement phase: norms that approach the maximum norm. A step along the gradient of the
/// worst corner of each ball stops earlier, where no single node can improve it.
inline constexpr int kRefinementPowers[] = {8, 16, 32};

/// The caller's positions, in executor memory.
template <class Real>
struct CallerPositions {
  const Vec3<Real>* positions;  // in the caller's order
  const NodeId* caller_ids;     // of a node of ours
};

/// Bytes of `optimize`: states, opposite nodes, and where a tangled mesh is repaired its input
/// and `limit_moves`.
[[nodiscard]] inline std::int64_t optimize_bytes(const MeshCounts& mesh,
                                                 const SmoothOptions& options) {
  const bool repairs = options.tangled == TangledPolicy::repair;
  return mesh.nodes + (mesh.only(4) ? 3 * 4 * mesh.entries : 0) +
         (repairs ? mesh.nodes * mesh.position_bytes + limit_moves_bytes(mesh.nodes, false) : 0);
}

/// The method Optimize: untangles where a ball is not valid, then descends the goal's energy,
/// then refines poor balls by high powers for Goal::worst.
///
/// takes  positions in internal order; surroundings with balls; a colouring
/// gives  the optimized positions in place. Valid elements stay valid; where not all
///        inverted ones could be repaired, moves that inverted a valid one are undone.
/// cost   per sweep two to four passes over each ball; `optimize_bytes`
/// order  deterministic
template <Backend B, class Real>
void optimize(B& backend, const SweepContext<typename B::Executor, Real>& given_context,
              const Optimize& method, ConvergenceMonitor& monitor,
              const CallerPositions<Real>& given, Vec3<Real>* positions) {
  auto& executor = backend.executor();
  const SmoothOptions& options = monitor.options();
  auto context = given_context;
  const auto opposite = backend.find_opposite_nodes(context.around);
  context.around.opposite = opposite.data();
  OptimizeSweeper<typename B::Executor, Real> sweeper(executor, context, positions);
  const MeshEnergy start = sweeper.measure(1);
  bool tangled = start.invalid > 0;
  if (method.target_quality > 0 && start.worst >= method.target_quality) {
    monitor.end(StopReason::target_reached);
    return;
  }

  OptimizeStats last;
  // True when the job goes on.
  const auto run = [&](const OptimizePhase& phase, const PhaseEnd& end) {
    if (monitor.sweeps_left() == 0) return !monitor.end(StopReason::iteration_limit);
    PhaseMonitor phase_monitor(monitor, phase, end, method.target_quality);
    sweeper.wake_all();
    backend.optimize_phase(sweeper, phase, phase_monitor);
    last = phase_monitor.last();
    return !phase_monitor.job_ended();
  };

  if (tangled) {
    const bool goes_on = run({.power = 1, .guard = false}, {.when_untangled = true});
    tangled = last.tangled > 0;
    if (tangled && options.guard) {
      const auto before = positions_in_order(executor, given.positions, given.caller_ids,
                                             context.around.node_count);
      auto repair = context;
      repair.acceptance = {.guard = true, .facets = context.around.sliding.any()};
      repair.displacement_limit = {};
      limit_moves(executor, repair, before.data(), positions);
    }
    if (!goes_on) return;
  }

  const double tolerance = options.tolerance.value;
  const auto free_count = static_cast<double>(monitor.free_count());
  const PhaseEnd converged{.least_gain = options.tolerance.relative ? tolerance * free_count : 0,
                           .least_move = options.tolerance.relative ? 0 : tolerance};
  if (!run({.power = power_of(method.goal), .guard = options.guard}, converged)) return;
  if (method.goal == Goal::worst) {
    const double poor = method.target_quality > 0 ? method.target_quality : kPoorMeanRatio;
    for (const int power : kRefinementPowers) {
      if (!run({.power = power, .poor = 1 / poor, .guard = options.guard}, converged)) return;
    }
  }
  const bool stuck = last.moves.moved == 0 && last.moves.held > 0;
  monitor.end(last.tangled > 0 || stuck ? StopReason::stagnated : StopReason::converged);
}

}  // namespace meshsmooth::detail
