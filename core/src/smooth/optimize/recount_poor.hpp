#pragma once

#include "smooth/base/positions.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/guard/kept_quality.hpp"
#include "smooth/optimize/optimize.hpp"

namespace meshsmooth::detail {

/// Whether `recount_poor` may follow `keep_quality`, for which the rings are kept.
[[nodiscard]] inline bool may_recount_poor(const SmoothOptions& options) {
  return options.report_below && keeps_quality(options);
}

/// Bytes of `recount_poor` besides those of `iterate` and of the colouring.
[[nodiscard]] inline std::int64_t recount_poor_bytes(const MeshCounts& mesh,
                                                     const SmoothOptions& options) {
  return anchor_weight(options) > 0 ? mesh.nodes * mesh.position_bytes : 0;
}

/// What holds poor elements of a mesh of which `keep_quality` has moved nodes back: as the method
/// reports it of its own result.
///
/// takes  surroundings with rings, balls and targets; the given positions
/// cost   a colouring and a sweep
/// order  deterministic
template <OptimizingBackend B, class Real>
std::optional<PoorElements> recount_poor(B& backend, Surroundings around,
                                         const SmoothOptions& options, const JobControl& control,
                                         JobMesh<typename B::Executor, Real>& job) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  typename E::template Buffer<Vec3<Real>> given;
  if (anchor_weight(options) > 0 || options.movement_limit) {
    given = positions_in_order(executor, job.given.data(), job.caller_ids.data(), job.node_count);
  }
  const auto anchors = find_anchors(executor, around, given.data(), options);
  around.anchors = anchors.data();
  const Colouring<E> colouring = backend.colour(around, job.caller_ids.data());
  ConvergenceMonitor monitor(options, control, job.box.diagonal(), job.free_count);
  SweepContext<E, Real> context{around, &colouring, acceptance_of(options)};
  if (options.movement_limit) {
    context.displacement_limit = {given.data(), monitor.in_mesh_unit(*options.movement_limit)};
  }
  Optimizer<B, Real>(backend, context, std::get<Optimize>(options.method), monitor,
                     job.positions.data())
      .report();
  return monitor.poor();
}

}  // namespace meshsmooth::detail
