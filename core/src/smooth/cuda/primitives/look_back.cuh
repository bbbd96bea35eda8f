#pragma once

#include <cstdint>

#include "smooth/cuda/base/warp.cuh"

namespace meshsmooth::detail {

/// Single-pass prefix sum over the blocks of a grid by decoupled look-back. Blocks must be numbered
/// in the order in which they start. Source: Merrill, Garland 2016, "Single-pass parallel prefix
/// scan with decoupled look-back".
/// needs  one 64-bit word per block, 0 before the kernel; sums below 2^62
/// Not CUB's: its tile state is no public interface and needs a kernel of its own to be cleared.
class LookBack {
 public:
  __device__ LookBack(unsigned long long* words, unsigned int block)
      : words_(words), block_(block) {}

  /// Publishes this block's own sum to the later blocks; one thread calls, as early as possible.
  __device__ void publish(unsigned long long own) const {
    words_[block_] = (block_ == 0 ? kPrefix : kOwn) | own;
  }
  /// The sum before this block; one whole warp calls, after `publish`. Each lane polls one earlier
  /// block, until one of them knows its whole prefix.
  __device__ unsigned long long sum_before(unsigned long long own) const {
    const unsigned int lane = threadIdx.x % kWarp;
    unsigned long long before = 0;
    for (std::int64_t last = static_cast<std::int64_t>(block_) - 1; last >= 0; last -= kWarp) {
      const std::int64_t at = last - lane;
      unsigned long long found = kPrefix;
      if (at >= 0) {
        do {
          found = words_[at];
        } while (found < kOwn);
      }
      __syncwarp();
      const unsigned int prefixes = __ballot_sync(kAllLanes, found >= kPrefix);
      const unsigned int used =
          prefixes == 0 ? kWarp - 1 : static_cast<unsigned int>(__ffs(prefixes)) - 1;
      before += sum_of_warp(lane <= used ? found & kValue : 0ULL);
      if (prefixes != 0) break;
    }
    if (lane == 0 && block_ != 0) words_[block_] = kPrefix | (before + own);
    return before;
  }

 private:
  static constexpr unsigned long long kOwn = 1ULL << 62, kPrefix = 2ULL << 62, kValue = kOwn - 1;
  volatile unsigned long long* words_;
  unsigned int block_;
};

}  // namespace meshsmooth::detail
