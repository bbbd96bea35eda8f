#pragma once

#include "smooth/cuda/device/cuda_executor.cuh"
#include "smooth/steps/optimize_sweeper.hpp"
#include "smooth/steps/phase_monitor.hpp"

namespace meshsmooth::detail {

// The parts of `optimize` that this backend does in its own way.

/// `only_tetrahedra`, known on the host.
[[nodiscard]] inline bool only_tetrahedra(CudaExecutor& executor, const Elements& elements) {
  return elements.run_count == 1 &&
         elements.runs[0].shape ==
             executor.lane().shapes() + static_cast<int>(ElementType::tetrahedron);
}

/// `find_opposite_nodes` with a team of threads to a ball, so that what is read and written
/// lies side by side.
[[nodiscard]] DeviceBuffer<NodeId> find_opposite_nodes(CudaExecutor& executor,
                                                       const Surroundings& around);

/// `run_phase` without a host between the sweeps, and a team of threads to a node. In a
/// translation unit of its own, whose multiplications and additions may be fused: what
/// Optimize gives on the backends agrees, but not bit by bit. Defined for float and double.
template <class Real>
void run_phase(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
               const OptimizePhase& phase, PhaseMonitor& watch);

}  // namespace meshsmooth::detail
