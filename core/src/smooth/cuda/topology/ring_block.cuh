#pragma once

#include <type_traits>

#include "smooth/cuda/primitives/look_back.cuh"
#include "smooth/cuda/topology/hashed_ring.cuh"
#include "smooth/cuda/topology/simplex_ring.cuh"

namespace meshsmooth::detail {

/// Load balancing inside a block: which of its nodes a thread searches. Sorted by ball size, so
/// that the threads of a warp do about the same amount of work. All threads call.
__device__ inline unsigned int balance_by_ball_size(const RingTask& task, std::size_t first,
                                                    unsigned int block) {
  constexpr unsigned int kBins = 2 * kWarp;
  __shared__ unsigned int begins[kBins];
  __shared__ unsigned char order[kRowsPerBlock];
  const unsigned int t = threadIdx.x, lane = t % kWarp;
  const std::size_t node = first + t;
  unsigned int bin = kBins - 1;
  if (node < task.node_count) {
    bin -= min(BallRow(task, node).size(), kBins - 1);
  }
  if (t < kBins) begins[t] = 0;
  __syncthreads();
  const unsigned int rank = atomicAdd(&begins[bin], 1U);
  __syncthreads();
  if (t < kWarp) {
    const unsigned int low = begins[2 * lane], both = low + begins[2 * lane + 1];
    const unsigned int sum = inclusive_sum(both);
    begins[2 * lane] = sum - both;
    begins[2 * lane + 1] = sum - both + low;
  }
  __syncthreads();
  order[begins[bin] + rank] = static_cast<unsigned char>(t);
  __syncthreads();
  // Warps of the same number share a scheduler. The blocks of one multiprocessor, whose numbers
  // differ by about kApart, have their largest balls in different warps.
  constexpr unsigned int kApart = 128;
  return order[(t + block / kApart * kWarp) % kRowsPerBlock];
}

/// Moves the balls of a block's nodes from their slots into their rows, if they are in slots, and
/// sorts each by the caller's element ids; all threads call. Rows are staged in shared memory,
/// where a thread sorts a short one and a warp a long one; what a warp cannot stage it sorts in
/// place.
__device__ inline void sort_balls(const RingTask& task, std::size_t first, RowEntries& rows,
                                  RowEntries& scratch) {
  const std::size_t own = first + threadIdx.x;
  const bool mine = own < task.node_count;
  const unsigned int lane = threadIdx.x % kWarp;
  const std::int64_t begin = task.ball_offsets[mine ? own : task.node_count];
  const auto size =
      static_cast<unsigned int>(mine ? task.ball_offsets[own + 1] - begin : std::int64_t{0});
  const std::int64_t warp_begin = __shfl_sync(kAllLanes, begin, 0);
  const auto start = static_cast<unsigned int>(begin - warp_begin);
  const unsigned int total = __shfl_sync(kAllLanes, start + size, kWarp - 1);
  ElementId* const entries = task.ball_entries + warp_begin;
  const ElementId* const caller_ids = task.element_caller_ids;
  const bool slotted = task.slots.entries != nullptr;
  const auto fetch_slots = [&](auto* to) {
    if (!slotted || !mine) return;
    const BallRow ball(task, own);
    for (unsigned int k = 0; k < ball.size(); ++k) {
      to[start + k] = static_cast<std::remove_reference_t<decltype(*to)>>(ball[k]);
    }
  };
  __syncthreads();  // the shared memory is free
  if (total > kStaged || task.elements.count >= kTooManyKeys) {
    fetch_slots(entries);
    __syncwarp();
    for (int r = 0; r < kWarp; ++r) {
      sort_by_warp(entries + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r),
                   [=](ElementId e) { return caller_ids == nullptr ? e : caller_ids[e]; });
    }
    return;
  }
  int* const staged = stage_of_warp(scratch);
  fetch_slots(staged);
  for (unsigned int i = lane; i < total && !slotted; i += kWarp) {
    staged[i] = static_cast<int>(entries[i]);
  }
  __syncwarp();
  const auto key = [=](int e) {
    return caller_ids == nullptr ? static_cast<ElementId>(e)
                                 : caller_ids[static_cast<ElementId>(e)];
  };
  const unsigned int own_size = size <= kRowCapacity ? size : 0;  // of a short row
  const bool wide = __any_sync(kAllLanes, own_size > kRowCapacity / 2) != 0;
  for (unsigned int k = 0; k < own_size; ++k) rows[k][threadIdx.x] = staged[start + k];
  sort_own_row(rows, scratch, static_cast<int>(own_size), wide, task.elements.count, key);
  for (unsigned int k = 0; k < own_size; ++k) staged[start + k] = rows[k][threadIdx.x];
  __syncwarp();
  for (unsigned int left = __ballot_sync(kAllLanes, own_size < size); left != 0; left &= left - 1) {
    const int r = __ffs(static_cast<int>(left)) - 1;
    sort_by_warp(staged + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r), key);
  }
  for (unsigned int i = lane; i < total; i += kWarp) entries[i] = static_cast<ElementId>(staged[i]);
}

/// The shared memory of a block of `ring_kernel` and the phases on it, each called by all threads.
template <int kNodes>
struct RingBlock {
  static constexpr int kWarps = kRowsPerBlock / kWarp;
  // Long rows of simplices are few: the whole block searches one, with large tables (instead of a
  // warp each: rings at 100k 76 to 70 us, H200).
  static constexpr int kSearchers = kNodes == 0 ? kWarps : 1;
  static constexpr unsigned int kSearcherSize = kRowsPerBlock / kSearchers;
  using Search = HashedRing<kNodes, kSearcherSize, kNodes == 0 ? 128 : 512>;

  RowEntries rows;
  union {
    RowEntries entries;
    typename Search::Tables tables[kSearchers];
  } scratch;
  int degrees[kRowsPerBlock];
  unsigned int parts[kRowsPerBlock];  // passes of a row that does not fit `rows`, else 0
  unsigned int warp_totals[kWarps];
  unsigned int long_count;
  unsigned int block;
  unsigned long long base;
  unsigned char columns[kRowsPerBlock];    // of a node's row in `rows`
  unsigned char long_rows[kRowsPerBlock];  // left to `HashedRing`

  static __device__ unsigned int searcher() { return threadIdx.x / kSearcherSize; }
  static __device__ unsigned int rank() { return threadIdx.x % kSearcherSize; }

  /// Numbers the blocks in the order in which they start, as the look-back requires.
  __device__ __forceinline__ unsigned int begin(const RingTask& task) {
    if (threadIdx.x == 0) {
      block = atomicAdd(&task.state->next_block, 1U);
      long_count = 0;
    }
    __syncthreads();
    return block;
  }

  /// Finds all rows of the block, unsorted, this thread that of node first + searched, and lists
  /// those that do not fit a short row.
  __device__ __forceinline__ void search(const RingTask& task, std::size_t first,
                                         unsigned int searched) {
    int degree = 0;
    if (first + searched < task.node_count) {
      if constexpr (kNodes == 0) {
        degree = kTooLong;
      } else {
        degree = find_simplex_row<kNodes>(task, static_cast<int>(first + searched), rows,
                                          scratch.entries);
      }
    }
    degrees[searched] = degree;
    columns[searched] = static_cast<unsigned char>(threadIdx.x);
    parts[threadIdx.x] = 0;
    if (degree == kTooLong) {
      long_rows[atomicAdd(&long_count, 1U)] = static_cast<unsigned char>(searched);
    }
    if (__syncthreads_or(degree == kTooLong) == 0) return;
    for (unsigned int at = searcher(); at < long_count; at += kSearchers) {
      search_long_row(task, first, long_rows[at]);
    }
    __syncthreads();
  }

  /// By as many passes as make the keys fit the tables.
  __device__ __forceinline__ void search_long_row(const RingTask& task, std::size_t first,
                                                  unsigned int r) {
    unsigned int found = 0, passes = 1;
    for (bool fits = false; !fits;) {
      fits = true;
      found = 0;
      for (unsigned int pass = 0; pass < passes && fits; ++pass) {
        Search search(task, scratch.tables[searcher()], static_cast<int>(first + r), passes, pass);
        fits = search.template run<true>([&](unsigned int index, int id) {
          if (index < kRowCapacity) rows[index][columns[r]] = id;
        });
        if (fits) search.mark_boundary();
        found += search.neighbour_count();
        Search::sync();
      }
      if (!fits) passes *= 2;
    }
    if (rank() == 0) {
      degrees[r] = static_cast<int>(found);
      parts[r] = passes > 1 || found > kRowCapacity ? passes : 0;
    }
  }

  /// Sorts the row that this thread has searched by the caller's ids.
  __device__ __forceinline__ void sort(const RingTask& task, unsigned int searched) {
    const int degree = parts[searched] == 0 ? degrees[searched] : 0;
    const bool wide = __any_sync(kAllLanes, degree > kRowCapacity / 2) != 0;
    sort_own_row(rows, scratch.entries, degree, wide, task.node_count,
                 [&](int node) { return task.caller_ids[node]; });
  }

  /// Stores the rows where some are long: short ones by their threads, `start` in the entries.
  __device__ __forceinline__ void store_mixed(const RingTask& task, std::size_t first,
                                              unsigned long long start, int degree) {
    if (parts[threadIdx.x] == 0) {
      for (int k = 0; k < degree; ++k) task.entries[start + k] = rows[k][columns[threadIdx.x]];
    }
    __syncthreads();
    for (unsigned int at = searcher(); at < long_count; at += kSearchers) {
      const unsigned int r = long_rows[at];
      if (parts[r] != 0) store_long_row(task, static_cast<int>(first + r), parts[r]);
    }
    __syncthreads();
  }

  /// Searches a row again, into memory, and sorts it.
  __device__ __forceinline__ void store_long_row(const RingTask& task, int node,
                                                 unsigned int passes) {
    NodeId* const row = task.entries + task.offsets[node];
    const NodeId* const caller_ids = task.caller_ids;
    typename Search::Tables& tables = scratch.tables[searcher()];
    if (passes == 1) {
      // The tables of facets are free: they sort pairs of key and entry.
      Search search(task, tables, node, 1, 0);
      search.template run<false>([&](unsigned int at, int id) {
        tables.facets[at] =
            static_cast<unsigned long long>(caller_ids[id]) << 32 | static_cast<unsigned int>(id);
      });
      const unsigned int found = search.neighbour_count();
      if (rank() < kWarp) {
        sort_by_warp(tables.facets, found, [](unsigned long long pair) { return pair; });
      }
      Search::sync();
      for (unsigned int k = rank(); k < found; k += kSearcherSize) {
        row[k] = static_cast<NodeId>(tables.facets[k] & 0xffffffffULL);
      }
      Search::sync();
      return;
    }
    unsigned int found = 0;
    for (unsigned int pass = 0; pass < passes; ++pass) {
      Search search(task, tables, node, passes, pass);
      search.template run<false>([&](unsigned int at, int id) { row[found + at] = id; });
      found += search.neighbour_count();
      Search::sync();
    }
    if (rank() < kWarp) sort_by_warp(row, found, [=](NodeId n) { return caller_ids[n]; });
  }
};

}  // namespace meshsmooth::detail
