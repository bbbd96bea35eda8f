#pragma once

#include "smooth/cuda/sweeps/padded_positions.cuh"
#include "smooth/cuda/sweeps/sell_rings.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// Jacobi sweeps with the positions in global memory, a thread per node.
/// grid   cooperative: blocks of kBlockSize that are all resident, four per multiprocessor; more
///        would leave each thread fewer registers, and so fewer loads in flight (10M 287 us with
///        four, 305 with five; 1M 45 and 51; H200)
/// shared one sum per warp
/// needs  rings; for `SellMean` a position of +0 after the last node
/// order  deterministic: sums by a fixed tree
/// fast   SELL-32, software-pipelined: 1M 44.4 us a sweep, 10M 287 us = 68 % of the copy bandwidth
///        (H200)
/// equals `sweep_jacobi`, bit by bit
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
      const Vec3<Real> position = step_to(goal, before, factor);
      spare.store(node, position);
      seen = seen + stats_of_move(before, position, false);
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

template <class Real, class Mean>
void run_jacobi_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                       const Mean& mean, Real factor, ConvergenceMonitor& monitor) {
  const Surroundings& around = sweeper.around();
  const std::size_t size = PaddedPositions<Real>::size(around.node_count);
  auto current_buffer = executor.allocate<Real>(size);
  auto spare_buffer = executor.allocate<Real>(size);
  PaddedPositions<Real> current(current_buffer.data(), around.node_count);
  PaddedPositions<Real> spare(spare_buffer.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.current(), current);
  pad_positions(executor, around.node_count, sweeper.current(), spare);
  constexpr auto kKernel = &jacobi_kernel<Mean, Real>;
  const unsigned int blocks =
      cooperative_blocks<kKernel>(executor.lane(), block_count(around.node_count));
  run_sweep_batches(
      executor, around.node_count, blocks, monitor,
      [&](const SweepBatch& batch) {
        launch_cooperative<kKernel>(executor.stream(), {blocks}, around, mean, factor, current,
                                    spare, batch);
      },
      [&](int sweeps) {
        if (sweeps % 2 != 0) std::swap(current, spare);
      });
  unpad_positions(executor, around.node_count, current, sweeper.current());
}

}  // namespace meshsmooth::detail
