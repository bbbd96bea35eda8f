#pragma once

#include <cub/block/block_radix_sort.cuh>

#include <vector>

#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::detail {

/// What a visit must know before it can ask for positions.
struct alignas(16) BallRecord {
  std::int64_t begin;  // of its entries in the balls
  NodeId node;
  std::int32_t size;
};

/// The nodes to visit, in device memory.
struct ColouredNodes {
  const BallRecord* records;
  const std::uint32_t* first;  // of a colour; one more at the end
  int colour_count;
};

/// Owns the nodes to visit, colour after colour. Runs of nodes of a colour are sorted by ball size,
/// so that the teams of a warp have about the same amount of work; alternately descending and
/// ascending, so that the largest balls do not always meet the same teams (smart Laplacian
/// 4.63 ms for 20 sweeps at 100k, in the order of the curve 4.75; H200).
struct BallRecords {
  DeviceBuffer<BallRecord> records;
  DeviceBuffer<std::uint32_t> first;  // of a colour; one more at the end
  int colour_count = 0;
  std::size_t largest = 0;  // nodes of a colour

  static constexpr std::int64_t bytes(std::int64_t node_count) {
    return node_count * std::int64_t{sizeof(BallRecord)};
  }
  [[nodiscard]] ColouredNodes nodes() const { return {records.data(), first.data(), colour_count}; }
};

inline constexpr int kRecordsEach = 8;
inline constexpr int kRecordRun = kBlockSize * kRecordsEach;

/// The colour of the n-th node to visit.
__device__ inline std::uint32_t colour_at(const std::uint32_t* first, int colour_count,
                                          std::uint32_t n) {
  std::uint32_t low = 0;
  for (auto high = static_cast<std::uint32_t>(colour_count); low + 1 < high;) {
    const std::uint32_t middle = (low + high) / 2;
    (first[middle] <= n ? low : high) = middle;
  }
  return low;
}

/// grid   a block of kBlockSize per kRecordRun nodes
/// shared CUB's radix sort
/// order  deterministic: a stable sort
/// equals nothing on the CPU: only the order of visits inside a colour depends on it
static __global__ void __launch_bounds__(kBlockSize)
    record_balls_kernel(const NodeId* nodes, Rows<ElementId> balls, const std::uint32_t* first,
                        int colour_count, BallRecord* records) {
  using Sort = cub::BlockRadixSort<std::uint32_t, kBlockSize, kRecordsEach, NodeId>;
  __shared__ typename Sort::TempStorage space;
  constexpr std::uint32_t kMostSize = 127;
  const std::uint32_t begin = blockIdx.x * kRecordRun;
  const std::uint32_t end = first[colour_count];
  const std::uint32_t colour = colour_at(first, colour_count, begin);
  std::uint32_t keys[kRecordsEach];
  NodeId ids[kRecordsEach];
  for (int k = 0; k < kRecordsEach; ++k) {
    const std::uint32_t n = begin + threadIdx.x * kRecordsEach + k;
    keys[k] = 0xffffffffU;
    ids[k] = -1;
    if (n >= end) continue;
    ids[k] = nodes[n];
    const auto size = static_cast<std::uint32_t>(balls.size(static_cast<std::size_t>(ids[k])));
    // Few colours meet in a run.
    const std::uint32_t bounded = size < kMostSize ? size : kMostSize;
    keys[k] = (colour_at(first, colour_count, n) - colour) * (kMostSize + 1) +
              (blockIdx.x % 2 == 0 ? kMostSize - bounded : bounded);
  }
  Sort(space).SortBlockedToStriped(keys, ids);
  for (int k = 0; k < kRecordsEach; ++k) {
    const std::uint32_t n = begin + k * kBlockSize + threadIdx.x;
    if (n >= end) continue;
    const auto node = static_cast<std::size_t>(ids[k]);
    const std::int64_t at = balls.offsets[node];
    records[n] = {at, ids[k], static_cast<std::int32_t>(balls.offsets[node + 1] - at)};
  }
}

inline BallRecords record_balls(CudaExecutor& executor, const Surroundings& around,
                                const Colouring<CudaExecutor>& colouring) {
  const std::vector<std::uint32_t> first(colouring.first.begin(), colouring.first.end());
  const std::size_t count = first.empty() ? 0 : first.back();
  BallRecords result;
  result.colour_count = static_cast<int>(colouring.count());
  result.records = executor.allocate<BallRecord>(count);
  result.first = executor.allocate<std::uint32_t>(first.size());
  executor.upload(first.data(), first.size(), result.first.data());
  for (int c = 0; c < result.colour_count; ++c) {
    result.largest = std::max<std::size_t>(result.largest, first[c + 1] - first[c]);
  }
  launch<&record_balls_kernel>(executor.stream(),
                               {static_cast<unsigned int>((count + kRecordRun - 1) / kRecordRun)},
                               colouring.nodes.data(), around.balls, result.first.data(),
                               result.colour_count, result.records.data());
  return result;
}

}  // namespace meshsmooth::detail
