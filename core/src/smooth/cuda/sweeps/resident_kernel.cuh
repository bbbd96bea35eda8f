#pragma once

#include "smooth/cuda/sweeps/patch.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// A position and the sweep it belongs to, accessed by one 16-byte operation: whoever reads it
/// knows from the datum itself whether it is the one awaited, without flag or fence.
struct alignas(16) TaggedPosition {
  float x, y, z;
  int tag;

  /// Relaxed and indivisible: sees a store of any block as a whole or not at all.
  static __device__ TaggedPosition load(const TaggedPosition* from) {
    unsigned long long low = 0, high = 0;
    asm volatile(
        "{ .reg .b128 whole; ld.relaxed.gpu.global.b128 whole, [%2]; mov.b128 {%0, %1}, whole; }"
        : "=l"(low), "=l"(high)
        : "l"(from)
        : "memory");
    return {__uint_as_float(static_cast<unsigned int>(low)),
            __uint_as_float(static_cast<unsigned int>(low >> 32)),
            __uint_as_float(static_cast<unsigned int>(high)), static_cast<int>(high >> 32)};
  }
  static __device__ void store(TaggedPosition* to, const TaggedPosition& value) {
    const auto joined = [](unsigned int low, unsigned int high) {
      return static_cast<unsigned long long>(high) << 32 | low;
    };
    const unsigned long long low = joined(__float_as_uint(value.x), __float_as_uint(value.y));
    const unsigned long long high =
        joined(__float_as_uint(value.z), static_cast<unsigned int>(value.tag));
    asm volatile(
        "{ .reg .b128 whole; mov.b128 whole, {%0, %1}; st.relaxed.gpu.global.b128 [%2], whole; }"
        :
        : "l"(low), "l"(high), "l"(to)
        : "memory");
  }
};

inline constexpr unsigned long long kOpen = 1ULL << 32;

/// Counts a block that has done a sweep, in the upper half also one whose moves do not end the
/// sweeps; a warp calls. (One counter per sweep: blocks that poll all the others' words get in the
/// way of the stores, 5k 2.9 instead of 2.0 us a sweep, H200.)
__device__ inline void publish_moves(const SweepBatch& batch, int sweep,
                                     const double* squared_moves, int count) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  long long largest = -1;  // bits of doubles, which have their order if none is negative
  double sum = 0;
  int moved = 0;
#pragma unroll 4
  for (int at = lane; at < count; at += kWarp) {
    const double squared = squared_moves[at];
    const long long bits = __double_as_longlong(squared);
    if (squared < 0) continue;
    largest = bits > largest ? bits : largest;
    sum += squared;
    ++moved;
  }
  largest = max_of_warp(largest);
  sum = sum_of_warp(sum);
  moved = sum_of_warp(moved);
  if (lane != 0) return;
  const bool open = moved > 0 && !is_below(word_of_move(largest), batch.tolerance);
  atomicAdd(&batch.largest[sweep], open ? kOpen + 1 : 1);
  batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + blockIdx.x] = {
      moved == 0 ? 0.0 : __longlong_as_double(largest), sum, moved, 0};
}

/// Whether a sweep was the last, once all blocks have done it; one thread calls.
[[nodiscard]] __device__ inline bool all_done_below(const SweepBatch& batch, int sweep) {
  const volatile unsigned long long& word = batch.largest[sweep];
  unsigned long long seen = word;
  while (seen % kOpen < gridDim.x) seen = word;
  return seen < kOpen;
}

inline constexpr int kMostResidentThreads = 768;  // that move nodes

/// Waits for the halo's positions before `sweep`; `threads` threads share this, each with four
/// loads in flight (one after the other: 100k 7.5 us a sweep, H200).
__device__ __forceinline__ void await_halo(const Patch& patch, int halo_begin,
                                           const TaggedPosition* tagged, int sweep, int threads) {
  constexpr int kAtOnce = 4;
  float4* const to = patch.positions(sweep) + halo_begin;
  for (int h = static_cast<int>(threadIdx.x); h < patch.halo_count(); h += kAtOnce * threads) {
    int nodes[kAtOnce];
    TaggedPosition seen[kAtOnce];
#pragma unroll
    for (int k = 0; k < kAtOnce; ++k) {
      const int at = h + k * threads;
      nodes[k] = at < patch.halo_count() ? patch.halo_node(at) : -1;
      if (nodes[k] >= 0) seen[k] = TaggedPosition::load(tagged + nodes[k]);
    }
#pragma unroll
    for (int k = 0; k < kAtOnce; ++k) {
      if (nodes[k] < 0) continue;
      while (seen[k].tag != sweep) seen[k] = TaggedPosition::load(tagged + nodes[k]);
      to[h + k * threads] = {seen[k].x, seen[k].y, seen[k].z, 0};
    }
  }
}

/// One sweep of a patch by `threads` threads; `out` receives the positions that other patches read.
__device__ __forceinline__ void sweep_patch(const Patch& patch, float factor, int sweep,
                                            int threads, TaggedPosition* out) {
  const float4* const from = patch.positions(sweep);
  float4* const to = patch.positions(sweep + 1);
  double* const squared_moves = patch.squared_moves(sweep);
  for (int at = static_cast<int>(threadIdx.x); at < patch.free_count(); at += threads) {
    const FreeNode free = patch.free_node(at);
    const float4 own = from[free.own()];
    const Vec3<float> before{own.x, own.y, own.z};
    const Vec3<float> position = step_to(patch.mean(at, from), before, factor);
    if (free.shared()) {
      TaggedPosition::store(&out[patch.node(free.own())],
                            {position.x, position.y, position.z, sweep + 1});
    }
    to[free.own()] = {position.x, position.y, position.z, 0};
    const SweepStats move = stats_of_move(before, position, false);
    squared_moves[free.own()] = move.moved == 0 ? -1.0 : move.max_squared;
  }
}

/// Jacobi sweeps of a mesh that fits the shared memories of the device. No grid barrier: blocks
/// exchange only their halos, through `tagged` (two per node, by the sweep's parity), and wait for
/// their neighbours only. What a block reads of sweep s, its owner overwrites in sweep s + 2, for
/// which it needs this block's s + 1: rings are symmetric, so whoever is read by a free node reads
/// it too. The last warp, the control warp, evaluates convergence: that sweep s met the tolerance
/// is known before sweep s + 2. Positions are triple-buffered, so that those after s are still
/// there.
///
/// grid   cooperative: a patch per block, one block per multiprocessor
/// shared a `Patch`, up to the device's limit
/// needs  rings symmetric and sorted, nodes along a curve
/// order  deterministic: sums by a fixed tree
/// fast   5k 2.0 and 100k 4.7 us a sweep (H200); from L2 a sweep takes 5.8 (a probe)
/// equals `sweep_jacobi`, bit by bit
static __global__ void __launch_bounds__(kMostResidentThreads + kWarp, 1)
    resident_kernel(Surroundings around, float factor, PatchSizes sizes, Vec3<float>* positions,
                    TaggedPosition* tagged, SweepBatch batch) {
  extern __shared__ __align__(16) unsigned char memory[];
  __shared__ bool stop[2];  // by the sweep's parity: fast warps are one sweep ahead
  const auto grid = cooperative_groups::this_grid();
  Patch patch(sizes, memory, around);
  const int t = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x) - kWarp;  // without the control warp
  const bool is_control = t >= threads;

  if (!patch.load(positions) && t == 0) atomicAdd(batch.overflow, 1U);
  for (int own = t; own < sizes.nodes; own += static_cast<int>(blockDim.x)) {
    patch.squared_moves(0)[own] = patch.squared_moves(1)[own] = -1;
    if (!patch.has(own)) continue;
    for (std::size_t parity = 0; parity < 2; ++parity) {
      TaggedPosition::store(&tagged[parity * around.node_count + patch.node(own)], {0, 0, 0, 0});
    }
  }
  if (t < 2) stop[t] = false;
  grid.sync();
  if (*static_cast<volatile unsigned int*>(batch.overflow) != 0) {
    if (blockIdx.x == 0 && t == 0) *batch.done = 0;
    return;
  }

  const auto publish = [&](int sweep) {
    publish_moves(batch, sweep, patch.squared_moves(sweep), sizes.nodes);
  };
  int done = 0;
  for (int sweep = 0;; ++sweep) {
    if (is_control) {
      if (t == threads && sweep > 1 && all_done_below(batch, sweep - 2)) stop[sweep % 2] = true;
    } else if (sweep > 0 && sweep < batch.most) {
      await_halo(patch, sizes.nodes,
                 tagged + static_cast<std::size_t>(sweep % 2) * around.node_count, sweep, threads);
    }
    __syncthreads();
    done = stop[sweep % 2] ? sweep - 1 : sweep;
    if (done < sweep || sweep == batch.most) break;
    if (!is_control) {
      sweep_patch(patch, factor, sweep, threads,
                  tagged + static_cast<std::size_t>((sweep + 1) % 2) * around.node_count);
    } else if (sweep > 0) {
      publish(sweep - 1);
    }
  }
  if (is_control && done == batch.most) publish(done - 1);
  const float4* const result = patch.positions(done);
  for (int at = t; at < patch.free_count(); at += static_cast<int>(blockDim.x)) {
    const int own = patch.free_node(at).own();
    positions[patch.node(own)] = {result[own].x, result[own].y, result[own].z};
  }
  report(grid, batch, done);
}

/// Jacobi sweeps with the mesh in shared memory. False, with nothing changed, if a patch does not
/// fit its block.
inline bool run_resident_sweeps(CudaExecutor& executor, const PatchSizes& sizes,
                                Sweeper<CudaExecutor, float>& sweeper, float factor,
                                ConvergenceMonitor& monitor) {
  constexpr auto kKernel = &resident_kernel;
  const Surroundings& around = sweeper.around();
  allow_shared_memory<kKernel>(executor.lane(), executor.lane().limits().shared_bytes);
  // Small patches have more halo than nodes.
  const Grid grid{
      static_cast<unsigned int>(sizes.patches(around.node_count)),
      static_cast<unsigned int>(std::clamp(sizes.nodes, 6 * kWarp, kMostResidentThreads) + kWarp),
      sizes.bytes()};
  auto tagged = executor.allocate<TaggedPosition>(2 * around.node_count);
  return run_sweep_batches(
      executor, around.node_count, grid.blocks, monitor,
      [&](const SweepBatch& batch) {
        launch_cooperative<kKernel>(executor.stream(), grid, around, factor, sizes,
                                    sweeper.current(), tagged.data(), batch);
      },
      [](int) {});
}

}  // namespace meshsmooth::detail
