#pragma once

#include "smooth/cuda/base/warp.cuh"

namespace meshsmooth::detail {

/// A barrier of a cooperative grid that also tells whether any thread raised a flag: who arrives
/// adds both to one word, so that the flag costs no synchronization of its own.
/// needs  `kWords` words in device memory, 0 before the kernel
class FlaggedBarrier {
 public:
  static constexpr int kWords = 4;

  __device__ explicit FlaggedBarrier(unsigned long long* words) : words_(words) {}

  /// All threads of the grid call. What they wrote before, all see afterwards.
  __device__ bool wait(bool flag = false) {
    __shared__ bool raised;
    const bool own = __syncthreads_or(flag ? 1 : 0) != 0;
    if (threadIdx.x == 0) {
      unsigned long long* const word = words_ + turn_ % kWords;
      // The word after the next: nobody polls it any more, and nobody adds to it yet.
      if (blockIdx.x == 0) words_[(turn_ + 2) % kWords] = 0;
      __threadfence();
      atomicAdd(word, own ? kRaised + 1 : 1);
      unsigned long long seen = 0;
      do {
        seen = *static_cast<volatile unsigned long long*>(word);
      } while (seen % kRaised < gridDim.x);
      __threadfence();
      raised = seen >= kRaised;
    }
    ++turn_;
    __syncthreads();
    return raised;
  }

 private:
  static constexpr unsigned long long kRaised = 1ULL << 32;
  unsigned long long* words_;
  int turn_ = 0;
};

}  // namespace meshsmooth::detail
