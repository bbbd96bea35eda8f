#pragma once

#include "smooth/cuda/sweeps/coloured_sweeps.cuh"
#include "smooth/cuda/sweeps/jacobi_sweeps.cuh"
#include "smooth/cuda/sweeps/resident_sweeps.cuh"

namespace meshsmooth::detail {

/// The sweeps of one step: without a host in between where the form and the
/// acceptance let nodes be judged on the spot.
template <class Real, class Mean>
void run_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper, const Mean& mean,
                double factor, ConvergenceMonitor& watch) {
  const Surroundings& around = sweeper.around();
  const auto f = static_cast<Real>(factor);
  // These kernels know neither displacement_limit nor sliding.
  if (sweeper.limited()) return run_sweeps_one_by_one(sweeper, mean, factor, watch);
  if (sweeper.form() == Form::gauss_seidel) {
    if (around.surface()) return run_coloured_sweeps<8>(executor, sweeper, mean, f, watch);
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      if (!sweeper.acceptance().active()) {
        return run_coloured_sweeps<16>(executor, sweeper, mean, f, watch);
      }
    }
    // A thread per element of an ordinary ball.
    return run_coloured_sweeps<32>(executor, sweeper, mean, f, watch);
  }
  if (sweeper.form() == Form::jacobi && !sweeper.acceptance().active()) {
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      // The memory model counts on this choice.
      const auto patch =
          PatchSizes::of(around.node_count, sizeof(Real), executor.lane().patch_limits());
      if constexpr (std::is_same_v<Real, float>) {
        if (patch && run_resident_sweeps(executor, *patch, sweeper, f, watch)) return;
      }
      if (!patch) {
        if (const auto rings = SellRings::of(executor, around)) {
          return run_jacobi_sweeps(executor, sweeper, SellMean(*rings), f, watch);
        }
      }
    }
    run_jacobi_sweeps(executor, sweeper, mean, f, watch);
    return;
  }
  run_sweeps_one_by_one(sweeper, mean, factor, watch);
}

}  // namespace meshsmooth::detail
