#pragma once

#include "smooth/averaging/only_below.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/cuda/quality/evaluator.cuh"
#include "smooth/cuda/sweeps/sweeps.cuh"
#include "smooth/cuda/topology/colouring.cuh"
#include "smooth/cuda/topology/prepare.cuh"
#include "smooth/energy/find_targets.hpp"
#include "smooth/fit/fit_bytes.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/pipeline/iterate.hpp"
#include "smooth/plan/memory_plan.hpp"

namespace meshsmooth::detail {

/// Bytes of a visit of all nodes colour by colour: `run_phase`, and the sweeps in place.
[[nodiscard]] inline std::int64_t visiting_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  const std::int64_t reference = plan.has_reference() && mesh.only(4) ? padded_bytes(mesh) : 0;
  return padded_bytes(mesh) + reference + BallRecords::bytes(mesh.nodes);
}

/// Whether Jacobi sweeps by uniform means, which have kernels of their own.
[[nodiscard]] inline bool sweeps_uniformly(const JobPlan& plan) {
  return plan.uniform_mean && plan.form == Form::jacobi && !plan.acceptance.active();
}

/// Bytes that the CUDA sweeps hold besides those of `iterate`, without sums; follows the choices of
/// `run_sweeps` and `run_phase`.
[[nodiscard]] inline std::int64_t extra_sweep_bytes(const MeshCounts& mesh, const JobPlan& plan,
                                                    const std::optional<PatchSizes>& patch) {
  const Acceptance& acceptance = plan.acceptance;
  const bool jacobi = plan.form == Form::jacobi;
  std::int64_t bytes = 0;
  if (plan.averages && jacobi && !acceptance.active()) {
    // Two padded copies of the positions instead of the sweeper's second array.
    bytes += 2 * padded_bytes(mesh) - mesh.nodes * mesh.position_bytes;
    if (plan.uniform_mean && !patch) bytes += SellRings::bytes(mesh);
  }
  if (jacobi && (plan.in_steps() || acceptance.active())) {
    // `iterate_bytes` counts steps one by one, which a kernel of all sweeps replaces.
    const std::int64_t counted = limit_moves_bytes(mesh.nodes, acceptance.smart);
    if (acceptance.guard) bytes += std::max<std::int64_t>(guarded_sweeps_bytes(mesh) - counted, 0);
  }
  if (plan.colours && plan.averages) bytes += visiting_bytes(mesh, plan);
  return bytes;
}

/// The device memory of a job, from its sizes alone.
[[nodiscard]] inline MemoryPlan plan_device_memory(const JobPlan& plan, const MeshSize& size,
                                                   const DeviceLimits& limits) {
  using S = JobStage;
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const BallPlan ball_plan = BallPlan::of(size, plan);
  // The boundary is a cube's; a plate has twice as much.
  const bool surface = mesh.dimension == 2 && plan.stays_on_surface;
  const std::int64_t balls = row_bytes(n, mesh.entries), rings = row_bytes(n, 2 * mesh.edges);
  const std::int64_t counting = FoundBalls::bytes(mesh, ball_plan);
  const std::int64_t look_back = n / 4;
  const auto patch =
      sweeps_uniformly(plan)
          ? PatchSizes::of(static_cast<std::size_t>(n), mesh.position_bytes == 12 ? 4 : 8, limits)
          : std::nullopt;
  const std::int64_t blocks =
      patch ? static_cast<std::int64_t>(patch->patches(static_cast<std::size_t>(n)))
            : std::min<std::int64_t>(n / kBlockSize + 1, 1056);
  const std::int64_t normals =
      mesh.dimension == 2 ? mesh.elements * std::int64_t{sizeof(PackedDirection)} : 0;
  const std::int64_t found = (plan.needs_balls ? balls : 0) + rings + normals;
  const std::int64_t sweeping =
      iterate_bytes(mesh, plan, visiting_bytes(mesh, plan)) + extra_sweep_bytes(mesh, plan, patch);
  const std::int64_t held = (ball_plan.kept ? balls : 0) + rings + look_back;  // once prepared
  const std::int64_t oriented = held + normals;
  const std::int64_t result = plan.keeps_quality ? n * mesh.position_bytes : 0;
  const std::int64_t evaluating = CudaEvaluator::device_bytes(mesh, plan.options);
  const std::int64_t regions =
      size.regions && (surface || plan.options.boundary != BoundaryPolicy::free) ? mesh.elements * 4
                                                                                 : 0;
  const std::int64_t mask = surface || plan.options.boundary == BoundaryPolicy::slide ? n : 0;

  MemoryPlan memory;
  memory.kept = job_bytes(mesh) + (surface ? 1 : 2) * constraint_bytes(mesh, plan) +
                fit_bytes(size) + target_bytes(mesh, plan);
  memory.beside = batch_bytes(blocks) + (std::int64_t{128} << 10);
  memory[S::order_nodes] = order_bytes(n);
  memory[S::find_neighbours] = ball_plan.slotted
                                   ? counting + held - look_back
                                   : std::max(counting + balls, balls + rings + look_back);
  memory[S::find_boundary] = held;
  memory[S::find_coincident] = held + finding_coincident_bytes(mesh, plan.options);
  memory[S::find_reference] = held + (plan.has_reference() ? padded_bytes(mesh) : 0);
  memory[S::constrain] = oriented + constraining_bytes(mesh, plan) + regions + mask;
  memory[S::measure_input] = oriented + evaluating + enclosed_volume_bytes(mesh);
  memory[S::find_boxes] = oriented + finding_boxes_bytes(mesh, plan);
  memory[S::find_anchors] = oriented;
  memory[S::fix_outside] = oriented + only_below_bytes(mesh, plan.options);
  memory[S::colour] = oriented + (plan.colours ? colour_search_bytes(n) : 0);
  memory[S::iterate] = found + (plan.colours ? n * 4 : 0) +
                       (plan.moves ? moving_bytes(mesh, plan, size.reference, sweeping) : sweeping);
  memory[S::measure_result] = std::max(found, oriented) + evaluating + result;
  memory[S::keep_quality] =
      found - (plan.recounts_poor ? 0 : rings) + keep_quality_bytes(mesh, plan) + result;
  memory[S::recount_poor] =
      plan.recounts_poor ? memory[S::iterate] + recount_poor_bytes(mesh, plan) + result : 0;
  return memory;
}

}  // namespace meshsmooth::detail
