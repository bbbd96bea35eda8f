#pragma once

#include <cub/warp/warp_scan.cuh>

namespace meshsmooth::detail {

inline constexpr int kWarp = 32;
inline constexpr unsigned int kAllLanes = 0xffffffffU;

/// Inclusive sum over the lanes of a whole warp. CUB's shuffle scan, which needs no storage.
template <class T>
__device__ T inclusive_sum(T value) {
  using Scan = cub::WarpScan<T>;
  typename Scan::TempStorage none;
  Scan(none).InclusiveSum(value, value);
  return value;
}

/// Butterfly reduction over a whole warp: all lanes get the same bits.
template <class T, class Combine>
__device__ T reduce_warp(T value, const Combine& combine) {
  for (int step = kWarp / 2; step > 0; step /= 2) {
    value = combine(value, __shfl_xor_sync(kAllLanes, value, step));
  }
  return value;
}
template <class T>
__device__ T max_of_warp(T value) {
  return reduce_warp(value, [](T a, T b) { return b > a ? b : a; });
}
template <class T>
__device__ T sum_of_warp(T value) {
  return reduce_warp(value, [](T a, T b) { return a + b; });
}

/// Exclusive sums of one value per thread.
template <class T>
struct BlockPrefix {
  T in_warp;      // of the lower lanes
  T before_warp;  // of the lower warps
  T total;        // of the block
};
/// All threads call; `warp_totals` is shared memory for one value per warp. (cub::BlockScan wants
/// the block size at compile time and does not give the sum in the warp.)
template <class T>
__device__ BlockPrefix<T> scan_block(T value, int warp_count, T* warp_totals) {
  const int own_warp = static_cast<int>(threadIdx.x) / kWarp;
  const T sum = inclusive_sum(value);
  if (threadIdx.x % kWarp == kWarp - 1) warp_totals[own_warp] = sum;
  __syncthreads();
  BlockPrefix<T> prefix{sum - value, 0, 0};
  for (int warp = 0; warp < warp_count; ++warp) {
    if (warp < own_warp) prefix.before_warp += warp_totals[warp];
    prefix.total += warp_totals[warp];
  }
  return prefix;
}

/// Warp-aggregated atomic increment of counters[index]: lanes with the same index issue one atomic
/// and number themselves. Returns the count before the own increment. `active` are the lanes that
/// call; those with `counts` false only take part in the vote.
template <class Counter>
__device__ Counter aggregated_increment(unsigned int active, Counter* counters, int index,
                                        bool counts = true) {
  const unsigned int same = __match_any_sync(active, counts ? index : -1);
  const unsigned int lane = threadIdx.x % kWarp;
  const int leader = __ffs(static_cast<int>(same)) - 1;
  Counter before = 0;
  if (counts && static_cast<int>(lane) == leader) {
    before = atomicAdd(&counters[index], static_cast<Counter>(__popc(same)));
  }
  return __shfl_sync(same, before, leader) +
         static_cast<Counter>(__popc(same & ((1U << lane) - 1)));
}

}  // namespace meshsmooth::detail
