#pragma once

#include <cooperative_groups.h>

#include "smooth/base/executor.hpp"
#include "smooth/cuda/base/launch.cuh"

namespace meshsmooth::detail {

/// Threads that share a node's visit: a ball of tetrahedra takes three turns.
inline constexpr std::size_t kRoundTeam = 8;
inline constexpr int kRoundCounts = 3;

/// Device memory of rounds: the marks of `Executor::run_rounds`, a list of the changed nodes, and
/// counts, the first of which is 0 before.
struct RoundMemory {
  std::uint8_t* marks;
  NodeId* list;
  unsigned int* counts;  // kRoundCounts
};

/// `Executor::run_rounds` without the host: each round adds to its count while the next one's is
/// cleared; two grid barriers a round.
/// grid   cooperative: blocks of kBlockSize that are all resident
template <class Visits, class Visit, class Settle>
__global__ void __launch_bounds__(kBlockSize)
    rounds_kernel(std::size_t count, Visits visits, Visit visit, Settle settle,
                  RoundMemory memory) {
  const auto grid = cooperative_groups::this_grid();
  const std::size_t threads = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t first = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  constexpr std::size_t kAtOnce = 4;  // marks in flight
  RoundChanges changes{count, nullptr};
  for (int round = 0; changes.count > 0; ++round) {
    const std::size_t visit_count = visits(changes);
    for (std::size_t i = first; i < visit_count; i += threads) visit(i, changes);
    if (first == 0) memory.counts[(round + 1) % kRoundCounts] = 0;
    grid.sync();
    unsigned int own = 0;
    for (std::size_t i = first; i < count; i += kAtOnce * threads) {
      std::uint8_t marks[kAtOnce];
      for (std::size_t k = 0; k < kAtOnce; ++k) {
        const std::size_t node = i + k * threads;
        marks[k] = node < count ? memory.marks[node] : 0;
      }
      for (std::size_t k = 0; k < kAtOnce; ++k) {
        if (marks[k] == 0) continue;
        const bool changed = settle(i + k * threads);
        memory.marks[i + k * threads] = changed ? 1 : 0;
        own += changed ? 1 : 0;
      }
    }
    unsigned int& counted = memory.counts[round % kRoundCounts];
    // One addition to the count by each warp, whose threads then list their nodes in turn.
    const unsigned int up_to_own = inclusive_sum(own);
    if (const unsigned int all = __shfl_sync(kAllLanes, up_to_own, kWarp - 1); all > 0) {
      unsigned int place = 0;
      if (threadIdx.x % kWarp == 0) place = atomicAdd(&counted, all);
      place = __shfl_sync(kAllLanes, place, 0) + up_to_own - own;
      for (std::size_t i = first; own > 0; i += threads) {
        if (memory.marks[i] == 0) continue;
        memory.marks[i] = 0;
        memory.list[place++] = static_cast<NodeId>(i);
        --own;
      }
    }
    grid.sync();
    changes = {static_cast<volatile unsigned int&>(counted), memory.list};
  }
}

}  // namespace meshsmooth::detail
