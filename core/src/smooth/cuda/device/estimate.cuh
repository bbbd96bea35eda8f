#pragma once

#include "smooth/cuda/sweeps/ball_record.hpp"
#include "smooth/cuda/sweeps/patch_sizes.hpp"
#include "smooth/cuda/sweeps/sell_rings.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"
#include "smooth/cuda/topology/ball_plan.hpp"
#include "smooth/steps/memory_model.hpp"

namespace meshsmooth::detail {

/// Bytes of the device buffers that the CUDA backend holds at its highest point.
[[nodiscard]] inline std::int64_t estimate_device_bytes(const MeshSize& size,
                                                        const SmoothOptions& options,
                                                        const PatchLimits& limits) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const std::int64_t position = size.float64 ? 24 : 12;
  const std::int64_t padded = size.float64 ? 24 : 16;  // in `PaddedPositions`
  const std::int64_t kept = 2 * n * position           // the caller's and ours
                            + n * 4 + n                // caller's node of a node, fixed or not
                            + mesh.entries * 4         // connectivity
                            + (mesh.types > 1 ? mesh.elements * 4 : 0) +
                            // Of a cube; a plate has twice the boundary.
                            2 * constraint_bytes(mesh, options);
  const std::int64_t balls = (n + 1) * 8 + mesh.entries * 4;
  const std::int64_t rings = (n + 1) * 8 + mesh.edges * 2 * 4;
  const std::int64_t renumbering = n * (12 + 8 + 8);  // keys, ids, the sort's own; numbers, sizes
  const BallPlan plan = BallPlan::of(size, options);
  const std::int64_t held_balls = plan.kept ? balls : 0;
  // Numbers and sizes; places while rows are filled, or slots while rings are searched for.
  const std::int64_t counting =
      n * 8 + n / 4 + (plan.slotted ? n * 4 * BallPlan::kSlots : mesh.entries);
  std::int64_t iterating = sweep_bytes(mesh, size.float64, options);
  // What the blocks of a sweep have summed up.
  std::int64_t sums = std::min<std::int64_t>(n / 256 + 1, 1056) * kMostInBatch *
                      static_cast<std::int64_t>(sizeof(SweepStats));
  const auto* laplacian = std::get_if<Laplacian>(&options.method);
  if (laplacian != nullptr && resolve_form(options) == Form::jacobi &&
      !acceptance_of(options).active()) {
    const auto patch =
        laplacian->weighting == Weighting::uniform
            ? PatchSizes::of(static_cast<std::size_t>(n), size.float64 ? 8 : 4, limits)
            : std::nullopt;
    // Two padded copies of the positions, for the sweep's own.
    iterating += n * (2 * padded - position);
    if (patch) {
      sums = static_cast<std::int64_t>(patch->patches(static_cast<std::size_t>(n))) * kMostInBatch *
             static_cast<std::int64_t>(sizeof(SweepStats));
    } else if (laplacian->weighting == Weighting::uniform) {
      iterating += n * 4 + n / 4 + SellRings::kMostPadding * mesh.edges * 2 * 4;
    }
  }
  const bool optimizes = std::holds_alternative<Optimize>(options.method);
  if (optimizes || (resolve_form(options) == Form::gauss_seidel &&
                    !std::holds_alternative<Taubin>(options.method))) {
    // Padded positions, and what visits know of their balls.
    const std::int64_t visiting = n * (padded + static_cast<std::int64_t>(sizeof(BallRecord)));
    // They are gone where moves that broke valid elements are taken back.
    const bool repairs = optimizes && options.tangled == TangledPolicy::repair;
    iterating += visiting - (repairs ? std::min(visiting, n * (position + 3)) : 0);
  }
  if (mesh.dimension == 2) {
    iterating += mesh.elements * static_cast<std::int64_t>(sizeof(PackedDirection));
  }
  const std::int64_t colouring = resolve_form(options) == Form::gauss_seidel ? n * 25 : 0;
  // The caller's regions; counts by node, and the caller's mask.
  const std::int64_t constraining =
      (size.regions && options.boundary != BoundaryPolicy::free ? mesh.elements * 4 : 0) +
      (options.boundary == BoundaryPolicy::slide ? n * 9 : 0);
  const std::int64_t finding = plan.slotted ? counting + held_balls + rings
                                            : std::max(counting + balls, balls + rings + n / 4);
  const std::int64_t peak =
      kept + std::max({renumbering, finding, held_balls + rings + n / 4 + colouring,
                       held_balls + rings + n / 4 + constraining,
                       (needs_balls(options) ? balls : 0) + rings + iterating +
                           (colouring > 0 ? n * 4 : 0)});
  return peak + peak / 50 + sums + (std::int64_t{128} << 10);  // and the judge's histograms
}

}  // namespace meshsmooth::detail
