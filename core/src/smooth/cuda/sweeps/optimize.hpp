#pragma once

#include <functional>

#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/optimize/optimize_sweeper.hpp"
#include "smooth/optimize/phase_monitor.hpp"

namespace meshsmooth::detail {

/// For every entry of the balls the element's other nodes.
[[nodiscard]] DeviceBuffer<NodeId> find_opposite_nodes(CudaExecutor& executor,
                                                       const Surroundings& around);

/// Runs a phase of the optimizer without the host between the sweeps, a team of threads per node.
/// Compiled in a translation unit of its own whose multiplications and additions may be fused: the
/// backends agree up to rounding. `measure` gives the energy of the mesh; it comes from the caller,
/// so that all energies are rounded by the same code. Defined for float and double.
template <class Real>
void run_phase(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
               const OptimizePhase& phase, PhaseMonitor& monitor,
               const std::function<MeshEnergy()>& measure);

}  // namespace meshsmooth::detail
