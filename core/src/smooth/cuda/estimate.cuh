#pragma once

#include "smooth/averaging/only_below.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/cuda/quality/evaluator.cuh"
#include "smooth/cuda/sweeps/sweeps.cuh"
#include "smooth/cuda/topology/colouring.cuh"
#include "smooth/cuda/topology/prepare.cuh"
#include "smooth/energy/find_targets.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/plan/iterate.hpp"
#include "smooth/plan/needs_balls.hpp"

namespace meshsmooth::detail {

/// Bytes of a visit of all nodes colour by colour: `run_phase`, and the sweeps in place.
[[nodiscard]] inline std::int64_t visiting_bytes(const MeshCounts& mesh,
                                                 const SmoothOptions& options) {
  const std::int64_t reference = has_reference(options) && mesh.only(4) ? padded_bytes(mesh) : 0;
  return padded_bytes(mesh) + reference + BallRecords::bytes(mesh.nodes);
}

/// Bytes that the CUDA sweeps hold besides those of `iterate`, without sums; mirrors the choices of
/// `run_sweeps` and `run_phase`.
[[nodiscard]] inline std::int64_t extra_sweep_bytes(const MeshCounts& mesh,
                                                    const SmoothOptions& options,
                                                    const std::optional<PatchSizes>& patch) {
  const MeanProperties mean = mean_properties(options.method);
  const Form form = resolve_form(options);
  const Acceptance acceptance = acceptance_of(options);
  std::int64_t bytes = 0;
  if (mean.averages && form == Form::jacobi && !acceptance.active()) {
    // Two padded copies of the positions instead of the sweeper's second array.
    bytes += 2 * padded_bytes(mesh) - mesh.nodes * mesh.position_bytes;
    if (mean.uniform && !patch) bytes += SellRings::bytes(mesh);
  }
  const bool in_steps = std::holds_alternative<Taubin>(options.method) ||
                        std::holds_alternative<HcLaplacian>(options.method);
  if (form == Form::jacobi && (in_steps || acceptance.active())) {
    // `iterate_bytes` counts steps one by one, which a kernel of all sweeps replaces.
    const std::int64_t counted = limit_moves_bytes(mesh.nodes, acceptance.smart);
    if (acceptance.guard) bytes += std::max<std::int64_t>(guarded_sweeps_bytes(mesh) - counted, 0);
  }
  if (form == Form::gauss_seidel && !std::holds_alternative<Taubin>(options.method) &&
      !std::holds_alternative<Optimize>(options.method)) {
    bytes += visiting_bytes(mesh, options);
  }
  return bytes;
}

/// Upper bound of the device buffers of a job, from its sizes alone: the highest of its stages.
[[nodiscard]] inline std::int64_t estimate_device_bytes(const MeshSize& size,
                                                        const SmoothOptions& given_options,
                                                        const DeviceLimits& limits) {
  const SmoothOptions options = sweeping_options(given_options);
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const BallPlan plan = BallPlan::of(size, options);
  // The boundary is a cube's; a plate has twice as much.
  const bool surface = mesh.dimension == 2 && stays_on_surface(options);
  const std::int64_t kept = job_bytes(mesh) + (surface ? 1 : 2) * constraint_bytes(mesh, options) +
                            target_bytes(mesh, options);
  const std::int64_t balls = row_bytes(n, mesh.entries), rings = row_bytes(n, 2 * mesh.edges);
  const std::int64_t counting = FoundBalls::bytes(mesh, plan);
  const std::int64_t look_back = n / 4;
  const bool colours = resolve_form(options) == Form::gauss_seidel;

  const bool resident = mean_properties(options.method).uniform &&
                        resolve_form(options) == Form::jacobi && !acceptance_of(options).active();
  const auto patch = resident ? PatchSizes::of(static_cast<std::size_t>(n),
                                               mesh.position_bytes == 12 ? 4 : 8, limits)
                              : std::nullopt;
  const std::int64_t blocks =
      patch ? static_cast<std::int64_t>(patch->patches(static_cast<std::size_t>(n)))
            : std::min<std::int64_t>(n / kBlockSize + 1, 1056);
  const std::int64_t normals =
      mesh.dimension == 2 ? mesh.elements * std::int64_t{sizeof(PackedDirection)} : 0;
  const std::int64_t found = (needs_balls(options) ? balls : 0) + rings + normals;
  const std::int64_t sweeping = iterate_bytes(mesh, options, visiting_bytes(mesh, options)) +
                                extra_sweep_bytes(mesh, options, patch);
  const bool moves = std::holds_alternative<Move>(given_options.method);
  const std::int64_t iterating =
      found + (moves ? motion_bytes(mesh, given_options, size.reference, sweeping) : sweeping) +
      (colours ? n * 4 : 0);

  const std::int64_t held = (plan.kept ? balls : 0) + rings + look_back;  // after `prepare`
  const std::int64_t result = keeps_quality(options) ? n * mesh.position_bytes : 0;
  const std::int64_t evaluating =
      std::max(found, held + normals) + CudaEvaluator::device_bytes(mesh, options) + result;
  const bool recounts = may_recount_poor(options);
  const std::int64_t keeping =
      found - (recounts ? 0 : rings) + keep_quality_bytes(mesh, options) + result;
  const std::int64_t recounting =
      recounts ? iterating + recount_poor_bytes(mesh, options) + result : 0;
  const std::int64_t regions =
      size.regions && (surface || options.boundary != BoundaryPolicy::free) ? mesh.elements * 4 : 0;
  const std::int64_t given = has_reference(options) ? padded_bytes(mesh) : 0;  // the reference
  const std::int64_t mask = surface || options.boundary == BoundaryPolicy::slide ? n : 0;
  const std::int64_t finding = plan.slotted ? counting + held - look_back
                                            : std::max(counting + balls, balls + rings + look_back);
  const std::int64_t peak =
      kept + std::max({order_bytes(n), finding, held + (colours ? colour_search_bytes(n) : 0),
                       held + constraining_bytes(mesh, options) + regions + mask,
                       held + finding_coincident_bytes(mesh, options), held + given,
                       held + only_below_bytes(mesh, options) + normals,
                       held + finding_boxes_bytes(mesh, options) + normals, iterating, evaluating,
                       keeping, recounting});
  const std::int64_t histograms = std::int64_t{128} << 10;
  return peak + peak / 50 + batch_bytes(blocks) + histograms;
}

}  // namespace meshsmooth::detail
