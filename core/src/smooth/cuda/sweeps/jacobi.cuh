#pragma once

#include "smooth/cuda/sweeps/padded_positions.cuh"
#include "smooth/cuda/sweeps/sell_rings.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// Form A. More blocks to a multiprocessor would leave each thread fewer registers,
/// and so fewer loads on their way: measured slower.
template <class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 4)
    jacobi_kernel(Surroundings around, Mean mean, Real factor, PaddedPositions<Real> current,
                  PaddedPositions<Real> spare, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const std::size_t threads = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t first = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    const auto move = [&](std::size_t node, Vec3<Real> goal) {
      const Vec3<Real> before = current[node];
      const Vec3<Real> place = step_to(goal, before, factor);
      spare.store(node, place);
      seen = seen + stats_of_move(before, place, false);
    };
    if constexpr (std::is_same_v<Mean, SellMean>) {
      SellMean::Ring ahead = mean.ring(first, around.node_count);
      for (std::size_t node = first; node < around.node_count; node += threads) {
        const SellMean::Ring ring = ahead;
        ahead = mean.ring(node + threads, around.node_count);
        if (ring.size > 0) move(node, mean(ring, current, node));
      }
    } else {
      for (std::size_t node = first; node < around.node_count; node += threads) {
        if (around.fixed[node] == 0) move(node, mean(around, current, node));
      }
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
    const PaddedPositions<Real> swapped = current;
    current = spare;
    spare = swapped;
  }
  report(grid, batch, sweep);
}

/// Form A with the positions in the device's memory.
template <class Real, class Mean>
void run_jacobi_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                       const Mean& mean, Real factor, ConvergenceMonitor& watch) {
  const Surroundings& around = sweeper.around();
  const std::size_t size = PaddedPositions<Real>::size(around.node_count);
  auto current_buffer = executor.allocate<Real>(size);
  auto spare_buffer = executor.allocate<Real>(size);
  PaddedPositions<Real> current(current_buffer.data(), around.node_count);
  PaddedPositions<Real> spare(spare_buffer.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.current(), current);
  pad_positions(executor, around.node_count, sweeper.current(), spare);
  constexpr auto kKernel = &jacobi_kernel<Mean, Real>;
  const unsigned int blocks = executor.cooperative_blocks<kKernel>(block_count(around.node_count));
  run_batches(
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(blocks, kBlockSize, 0, around, mean, factor, current,
                                             spare, batch);
      },
      [&](int sweeps) {
        if (sweeps % 2 != 0) std::swap(current, spare);
      });
  unpad_positions(executor, around.node_count, current, sweeper.current());
}

}  // namespace meshsmooth::detail
