#pragma once

#include <cooperative_groups.h>

#include "smooth/cuda/device/launch.cuh"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// Threads that share a node's visit: a ball of tetrahedra takes three turns.
inline constexpr std::size_t kRoundTeam = 8;
inline constexpr int kRoundCounts = 3;

/// `Executor::run_rounds` without the host.
/// grid   cooperative: blocks of kBlockSize that are all resident
/// needs  `changes` 0: each round adds to the next one's count while the one after that is cleared
/// cost   two synchronizations of the grid a round
template <class Visits, class Visit, class Settle>
__global__ void __launch_bounds__(kBlockSize)
    rounds_kernel(std::size_t count, Visits visits, Visit visit, Settle settle,
                  unsigned int* changes) {
  const auto grid = cooperative_groups::this_grid();
  const std::size_t threads = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t first = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  std::size_t changed = count;
  for (int round = 0; changed > 0; ++round) {
    const std::size_t visit_count = visits(changed);
    for (std::size_t i = first; i < visit_count; i += threads) visit(i, changed);
    if (first == 0) changes[(round + 1) % kRoundCounts] = 0;
    grid.sync();
    unsigned int own = 0;
    for (std::size_t i = first; i < count; i += threads) own += settle(i) ? 1 : 0;
    own = sum_of_warp(own);
    if (threadIdx.x % kWarp == 0 && own > 0) atomicAdd(&changes[round % kRoundCounts], own);
    grid.sync();
    changed = static_cast<volatile unsigned int&>(changes[round % kRoundCounts]);
  }
}

}  // namespace meshsmooth::detail
