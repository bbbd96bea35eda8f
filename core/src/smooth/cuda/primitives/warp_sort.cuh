#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "smooth/cuda/base/warp.cuh"

namespace meshsmooth::detail {

/// Sorts a row of any length in place by `key`, one warp per row. Bitonic merges; missing entries
/// count as the highest, so `count` need be no power of two. O(count log^2 count / 32).
/// (cub::WarpMergeSort wants the length at compile time.)
template <class Id, class Key>
__device__ void sort_by_warp(Id* row, unsigned int count, const Key& key) {
  const unsigned int lane = threadIdx.x % kWarp;
  const auto order = [&](unsigned int a, unsigned int b) {
    if (b >= count) return;
    const Id x = row[a], y = row[b];
    if (key(y) < key(x)) {
      row[a] = y;
      row[b] = x;
    }
  };
  for (unsigned int size = 2; size < 2 * count; size *= 2) {
    for (unsigned int pair = lane; pair < (count + size) / 2; pair += kWarp) {
      const unsigned int start = pair / (size / 2) * size, at = pair % (size / 2);
      order(start + at, start + size - 1 - at);
    }
    __syncwarp();
    for (unsigned int step = size / 4; step > 0; step /= 2) {
      for (unsigned int pair = lane; pair < (count + size) / 2; pair += kWarp) {
        const unsigned int at = pair / step * 2 * step + pair % step;
        order(at, at + step);
      }
      __syncwarp();
    }
  }
}

/// The comparisons of a sorting network. Source: Batcher 1968, "Sorting networks and
/// their applications", the odd-even merge.
template <int kCount>
struct SortingNetwork {
  struct Pair {
    int low, high;
  };
  static constexpr int for_each(auto&& body) {
    int count = 0;
    for (int p = 1; p < kCount; p *= 2) {
      for (int k = p; k > 0; k /= 2) {
        for (int first = k % p; first + k < kCount; first += 2 * k) {
          for (int low = first; low < first + k && low + k < kCount; ++low) {
            if (low / (2 * p) == (low + k) / (2 * p)) body(count++, Pair{low, low + k});
          }
        }
      }
    }
    return count;
  }
  static constexpr int kPairCount = for_each([](int, Pair) {});
  static constexpr auto kPairs = [] {
    std::array<Pair, kPairCount> pairs{};
    for_each([&](int index, Pair pair) { pairs[static_cast<std::size_t>(index)] = pair; });
    return pairs;
  }();
};

template <int kCount, std::size_t... kIndex>
__device__ void apply_network(std::uint32_t (&values)[kCount], std::index_sequence<kIndex...>) {
  const auto order = [](std::uint32_t& a, std::uint32_t& b) {
    const std::uint32_t lower = min(a, b);
    b = max(a, b);
    a = lower;
  };
  using Network = SortingNetwork<kCount>;
  (order(values[std::integral_constant<int, Network::kPairs[kIndex].low>::value],
         values[std::integral_constant<int, Network::kPairs[kIndex].high>::value]),
   ...);
}

/// Sorts the registers of one thread without a branch. The indices are constants, hence the fold: a
/// loop that the compiler does not unroll puts the values into local memory.
template <int kCount>
__device__ void sort_registers(std::uint32_t (&values)[kCount]) {
  apply_network(values, std::make_index_sequence<SortingNetwork<kCount>::kPairCount>());
}

}  // namespace meshsmooth::detail
