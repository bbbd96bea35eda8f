#pragma once

#include "smooth/cuda/sweeps/guarded_sweeps.cuh"
#include "smooth/cuda/sweeps/jacobi.cuh"
#include "smooth/cuda/sweeps/resident_kernel.cuh"
#include "smooth/cuda/sweeps/smart_move.cuh"

namespace meshsmooth::detail {

/// The sweeps of one step, without the host in between where a cooperative kernel covers form and
/// acceptance.
template <class Real, class Mean>
void run_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper, const Mean& mean,
                double factor, ConvergenceMonitor& monitor) {
  const Surroundings& around = sweeper.around();
  const auto f = static_cast<Real>(factor);
  // The kernels support neither displacement limits nor sliding.
  if (sweeper.limited()) return run_sweeps_one_by_one(sweeper, mean, factor, monitor);
  if (sweeper.form() == Form::gauss_seidel) {
    if (around.surface()) return run_coloured_sweeps<8>(executor, sweeper, mean, f, monitor);
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      if (!sweeper.acceptance().active()) {
        return run_coloured_sweeps<16>(executor, sweeper, mean, f, monitor);
      }
      if (around.elements.tetrahedra) {
        return run_coloured_sweeps<32, true>(executor, sweeper, mean, f, monitor);
      }
    }
    // A thread per element of an ordinary ball.
    return run_coloured_sweeps<32>(executor, sweeper, mean, f, monitor);
  }
  if (sweeper.form() == Form::jacobi && !sweeper.acceptance().active()) {
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      // As `plan_device_memory` counts.
      const auto patch = PatchSizes::of(around.node_count, sizeof(Real), executor.lane().limits());
      if constexpr (std::is_same_v<Real, float>) {
        if (patch && run_resident_sweeps(executor, *patch, sweeper, f, monitor)) return;
      }
      if (!patch) {
        if (const auto rings = SellRings::of(executor, around)) {
          return run_jacobi_sweeps(executor, sweeper, SellMean(*rings), f, monitor);
        }
      }
    }
    run_jacobi_sweeps(executor, sweeper, mean, f, monitor);
    return;
  }
  if (sweeper.form() == Form::jacobi && !sweeper.acceptance().smart) {
    return run_guarded_sweeps(executor, sweeper, std::array{LaplacianStep<Mean, Real>{mean, f}},
                              monitor);
  }
  run_sweeps_one_by_one(sweeper, mean, factor, monitor);
}

/// The same for sweeps of steps of Jacobi form.
template <class Real, class Step, std::size_t kSteps>
void run_steps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
               const std::array<Step, kSteps>& steps, ConvergenceMonitor& monitor) {
  if (sweeper.limited()) return run_steps_one_by_one(executor, sweeper, steps, monitor);
  run_guarded_sweeps(executor, sweeper, steps, monitor);
}

}  // namespace meshsmooth::detail
