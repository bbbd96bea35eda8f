#pragma once

#include "smooth/base/positions.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/guard/kept_quality.hpp"
#include "smooth/optimize/optimize.hpp"

namespace meshsmooth::detail {

/// Bytes of `recount_poor` besides those of `iterate` and of the colouring.
[[nodiscard]] inline std::int64_t recount_poor_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  return plan.anchor_weight > 0 ? mesh.nodes * mesh.position_bytes : 0;
}

/// What holds poor elements of a mesh of which `keep_quality` has moved nodes back: as the method
/// reports it of its own result.
///
/// takes  surroundings with rings, balls and targets; the given positions
/// cost   a colouring and a sweep
/// order  deterministic
template <OptimizingBackend B, class Real>
std::optional<PoorElements> recount_poor(B& backend, Surroundings around, const JobPlan& plan,
                                         const JobControl& control,
                                         JobMesh<typename B::Executor, Real>& job) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  typename E::template Buffer<Vec3<Real>> given;
  const std::optional<MovementLimit>& limit = plan.options.movement_limit;
  if (plan.anchor_weight > 0 || limit) {
    given = positions_in_order(executor, job.given.data(), job.caller_ids.data(), job.node_count);
  }
  const auto anchors = find_anchors(executor, around, given.data(), plan);
  around.anchors = anchors.data();
  const Colouring<E> colouring = backend.colour(around, job.caller_ids.data());
  ConvergenceMonitor monitor(plan, control, job.box.diagonal(), job.free_count);
  SweepContext<E, Real> context{around, &colouring, plan.acceptance};
  if (limit) context.displacement_limit = {given.data(), monitor.in_mesh_unit(*limit)};
  Optimizer<B, Real>(backend, context, plan.optimizer.value(), monitor, job.positions.data())
      .report();
  return monitor.poor();
}

}  // namespace meshsmooth::detail
