#pragma once

#include <cooperative_groups.h>

#include <utility>

#include "smooth/averaging/sweeper.hpp"
#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/cuda/sweeps/batch_loop.cuh"

namespace meshsmooth::detail {

/// Sweeps done by one launch of a kernel whose blocks wait for each other.
struct SweepBatch {
  int most;                     // sweeps
  double tolerance;             // ends when the largest move is below
  unsigned long long* largest;  // a word per sweep, 0 before
  unsigned int* overflow;       // blocks without room for their share, 0 before
  SweepStats* partial;          // [sweep][block]
  SweepStats* stats;            // [sweep], host memory
  int* done;                    // sweeps done, host memory; 0: impossible this way
};

/// Not longer than the monitor can look ahead.
inline constexpr int kMostInBatch = ConvergenceMonitor::kPatience;

/// A squared move as a word of the same order. 0 stands for no move; a move whose square underflows
/// to 0 is still one.
__device__ inline unsigned long long word_of_move(long long bits) {
  return bits > 0 ? static_cast<unsigned long long>(bits) : 1;
}

/// Whether the largest move ends the sweeps.
__device__ inline bool is_below(unsigned long long word, double tolerance) {
  return word == 0 || sqrt(__longlong_as_double(static_cast<long long>(word))) < tolerance;
}

/// Publishes this block's largest move to the other blocks; all threads call.
__device__ inline void publish_largest(const SweepBatch& batch, int sweep, const SweepStats& seen) {
  __shared__ unsigned long long largest;
  const unsigned long long own =
      max_of_warp(seen.moved == 0 ? 0 : word_of_move(__double_as_longlong(seen.max_squared)));
  if (threadIdx.x == 0) largest = 0;
  __syncthreads();
  if (threadIdx.x % kWarp == 0 && own > 0) atomicMax(&largest, own);
  __syncthreads();
  if (threadIdx.x == 0 && largest > 0) atomicMax(&batch.largest[sweep], largest);
}

/// The sum over a warp, for lane 0, by a fixed tree.
__device__ inline SweepStats fold_warp(SweepStats sum) {
  for (int step = kWarp / 2; step > 0; step /= 2) {
    sum = sum + SweepStats{__shfl_down_sync(kAllLanes, sum.max_squared, step),
                           __shfl_down_sync(kAllLanes, sum.sum_squared, step),
                           __shfl_down_sync(kAllLanes, sum.moved, step),
                           __shfl_down_sync(kAllLanes, sum.held, step)};
  }
  return sum;
}

/// The sum over a block, for thread 0, by a fixed tree; `shared` holds kWarpsPerBlock values.
__device__ inline SweepStats sum_of_block(SweepStats own, SweepStats* shared) {
  own = fold_warp(own);
  if (threadIdx.x % kWarp == 0) shared[threadIdx.x / kWarp] = own;
  __syncthreads();
  SweepStats sum;
  if (threadIdx.x < kWarp) {
    if (threadIdx.x < kWarpsPerBlock) sum = shared[threadIdx.x];
    sum = fold_warp(sum);
  }
  __syncthreads();
  return sum;
}

/// Ends a sweep: true if it was the last. Split barrier: the blocks sum up while they wait.
template <class Grid>
__device__ bool end_sweep(const Grid& grid, const SweepBatch& batch, int sweep,
                          const SweepStats& seen, SweepStats* shared) {
  publish_largest(batch, sweep, seen);
  auto arrival = grid.barrier_arrive();
  const SweepStats sum = sum_of_block(seen, shared);
  if (threadIdx.x == 0) {
    batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + blockIdx.x] = sum;
  }
  grid.barrier_wait(std::move(arrival));
  const unsigned long long word = *static_cast<volatile unsigned long long*>(&batch.largest[sweep]);
  return is_below(word, batch.tolerance) || sweep + 1 == batch.most;
}

/// Ends a batch: the sums over all blocks, by a fixed tree, a warp per sweep.
template <class Grid>
__device__ void report(const Grid& grid, const SweepBatch& batch, int done) {
  grid.sync();
  const unsigned int warps_per_block = blockDim.x / kWarp;
  const unsigned int lane = threadIdx.x % kWarp;
  for (unsigned int sweep = blockIdx.x * warps_per_block + threadIdx.x / kWarp;
       sweep < static_cast<unsigned int>(done); sweep += gridDim.x * warps_per_block) {
    SweepStats sum;
    for (unsigned int b = lane; b < gridDim.x; b += kWarp) {
      sum = sum + batch.partial[std::size_t{sweep} * gridDim.x + b];
    }
    sum = fold_warp(sum);
    if (lane == 0) batch.stats[sweep] = sum;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *batch.done = done;
}

/// Bytes of the sums of a batch.
[[nodiscard]] constexpr std::int64_t batch_bytes(std::int64_t blocks) {
  return blocks * kMostInBatch * std::int64_t{sizeof(SweepStats)};
}

/// Runs batches of Laplacian sweeps until the monitor ends them. `launch(batch)` queues one,
/// `finish(sweeps)` is told how many it did. False if a batch could not be done this way.
template <class Launch, class Finish>
bool run_sweep_batches(CudaExecutor& executor, std::size_t node_count, unsigned int blocks,
                       ConvergenceMonitor& monitor, const Launch& launch, const Finish& finish) {
  auto words = executor.allocate<unsigned long long>(kMostInBatch + 1);
  auto partial = executor.allocate<SweepStats>(std::size_t{kMostInBatch} * blocks);
  auto* const stats = executor.lane().mapped<SweepStats>(CudaLane::kSweepsOffset);
  int& done = *reinterpret_cast<int*>(stats + kMostInBatch);
  run_batches(
      node_count, kMostInBatch, monitor, done,
      [&](int most) {
        executor.clear(words.data(), words.size());
        launch(SweepBatch{most, monitor.tolerance(), words.data(),
                          reinterpret_cast<unsigned int*>(words.data() + kMostInBatch),
                          partial.data(), stats, &done});
      },
      [&] {
        executor.synchronize();
        executor.check();
        finish(done);
        bool ended = done == 0;
        for (int sweep = 0; sweep < done; ++sweep) ended |= monitor.ended_by(stats[sweep]);
        return ended;
      });
  return done != 0;
}

}  // namespace meshsmooth::detail
