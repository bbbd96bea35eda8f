#pragma once

#include <array>
#include <type_traits>
#include <utility>

#include "smooth/boundary.hpp"
#include "smooth/cuda/cuda_executor.cuh"
#include "smooth/cuda/prepare_state.hpp"
#include "smooth/topology.hpp"

namespace meshsmooth::detail {

/// Rings and boundary, from the balls.
struct RowTask {
  std::size_t node_count;
  Elements elements;
  std::int64_t* ball_offsets;
  ElementId* ball_entries;
  const NodeId* caller_of;         // of nodes
  const ElementId* element_names;  // caller's element of an element; null: the same
  bool sort_balls;
  std::int64_t* offsets;
  NodeId* entries;
  std::size_t capacity;  // entries that there is room for
  std::uint8_t* on_boundary;
  unsigned long long* look_back;  // one word a block, 0 before
  PrepareState* state;
};

inline constexpr int kRowsPerBlock = 128;  // as many threads
inline constexpr int kRowCapacity = 32;    // longer rows are a case for `RowSearch`

/// A short row per thread in shared memory: entry k of all threads lies together,
/// so that no two threads meet in a bank.
using RowEntries = int[kRowCapacity][kRowsPerBlock];

/// A hash of an id.
__device__ inline unsigned int mixed(unsigned int h) {
  h *= 0x9e3779b1U;
  h = (h ^ (h >> 15)) * 0x85ebca6bU;
  return h ^ (h >> 13);
}

/// Sorts a row in place, by a whole warp. Bitonic merges whose missing entries
/// count as the highest, so that any count will do. O(count log^2 count / 32).
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

/// Sorts in registers.
template <int kCount, std::size_t... kIndex>
__device__ void sort_by_network(std::uint32_t (&values)[kCount], std::index_sequence<kIndex...>) {
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

/// Sorts this thread's row by `key(entry)`, of which there are not more than `key_count`.
/// A key and an entry's place make one word where they fit it, so that a row is sorted in
/// registers without a branch; else the place goes with its key in `keys`. `wide`: some
/// row of the warp has more than half the capacity.
template <class Key>
__device__ void sort_own_row(RowEntries& row, RowEntries& keys, int count, bool wide,
                             std::size_t key_count, const Key& key) {
  const unsigned int t = threadIdx.x;
  constexpr int kPlaceBits = 5;
  static_assert(kRowCapacity == 1 << kPlaceBits);
  if (key_count < std::size_t{1} << (32 - kPlaceBits)) {
    const auto sort = [&]<int kCount>() {
      std::uint32_t words[kCount];
#pragma unroll
      for (int k = 0; k < kCount; ++k) {
        words[k] = k < count ? static_cast<std::uint32_t>(key(row[k][t])) << kPlaceBits | k : ~0U;
      }
      sort_by_network(words, std::make_index_sequence<SortingNetwork<kCount>::kPairCount>());
#pragma unroll
      for (int k = 0; k < kCount; ++k) {
        if (k < count) words[k] = row[words[k] % kRowCapacity][t];
      }
#pragma unroll
      for (int k = 0; k < kCount; ++k) {
        if (k < count) row[k][t] = static_cast<int>(words[k]);
      }
    };
    if (wide) {
      sort.template operator()<kRowCapacity>();
    } else {
      sort.template operator()<kRowCapacity / 2>();
    }
    return;
  }
  for (int i = 0; i < count; ++i) keys[i][t] = static_cast<int>(key(row[i][t]));
  for (int i = 1; i < count; ++i) {
    const int entry = row[i][t];
    const auto own_key = static_cast<unsigned int>(keys[i][t]);
    int j = i;
    for (; j > 0 && static_cast<unsigned int>(keys[j - 1][t]) > own_key; --j) {
      row[j][t] = row[j - 1][t];
      keys[j][t] = keys[j - 1][t];
    }
    row[j][t] = entry;
    keys[j][t] = static_cast<int>(own_key);
  }
}

/// Copies between rows of a warp's threads and the stretch of memory in which
/// they lie one behind the other, in whole lines. `start` is the thread's place
/// in the stretch; no row is longer than kRowCapacity.
template <bool kStore, class Id>
__device__ void copy_rows(RowEntries& rows, RowEntries& scratch, Id* stretch, unsigned int start,
                          unsigned int count) {
  const unsigned int lane = threadIdx.x % kWarp;
  int* const staged = &scratch[0][0] + threadIdx.x / kWarp * (kRowCapacity * kWarp);
  const unsigned int total = __shfl_sync(kAllLanes, start + count, kWarp - 1);
  __syncthreads();  // the scratch of all warps is one
  if constexpr (kStore) {
    for (unsigned int k = 0; k < count; ++k) staged[start + k] = rows[k][threadIdx.x];
    __syncwarp();
    for (unsigned int i = lane; i < total; i += kWarp) stretch[i] = static_cast<Id>(staged[i]);
  } else {
    for (unsigned int i = lane; i < total; i += kWarp) staged[i] = static_cast<int>(stretch[i]);
    __syncwarp();
    for (unsigned int k = 0; k < count; ++k) rows[k][threadIdx.x] = staged[start + k];
  }
  __syncthreads();
}

/// The pairs i < j of a short row, a bit each.
inline constexpr int kPairWords = kRowCapacity * (kRowCapacity - 1) / 2 / 32 + 1;

inline constexpr int kTooLong = -1;  // in place of a degree

/// Ring and boundary mark of this thread's node; the row is left unsorted in
/// `row`. Returns the degree, or kTooLong.
///
/// A facet at the node is a pair of its neighbours (in a surface one neighbour):
/// once the neighbours are numbered, a bit for every pair says whether it was
/// seen, another whether twice. Nothing but node ids is ever compared.
template <int kNodes>
__device__ int find_simplex_row(const RowTask& task, int node, RowEntries& row, RowEntries& pairs) {
  static_assert(2 * kPairWords <= kRowCapacity);
  const unsigned int t = threadIdx.x;
  for (int w = 0; w < 2 * kPairWords; ++w) pairs[w][t] = 0;
  for (int k = 0; k < kRowCapacity; ++k) row[k][t] = -1;
  int degree = 0;
  int overused = 0;
  const auto count_pair = [&](int index) {
    const int word = index / 32;
    const int bit = 1 << (index % 32);
    const int seen = pairs[word][t], twice = pairs[kPairWords + word][t];
    pairs[word][t] = seen | bit;
    pairs[kPairWords + word][t] = twice | (seen & bit);
    overused |= twice & bit;
  };
  const auto pair_index = [](int a, int b) {
    return a < b ? b * (b - 1) / 2 + a : a * (a - 1) / 2 + b;
  };
  constexpr int kOthers = kNodes - 1;
  const NodeId* const connectivity = task.elements.runs[0].nodes;
  const std::int64_t end = task.ball_offsets[node + 1];
  const std::int64_t begin = task.ball_offsets[node];
  // Two loads that hang on each other are on their way while an element is looked at.
  int ahead[kNodes];
  ElementId next = begin < end ? task.ball_entries[begin] : 0;
  if (begin < end) load_group(connectivity + std::size_t{next} * kNodes, ahead);
  if (begin + 1 < end) next = task.ball_entries[begin + 1];
  for (std::int64_t e = begin; e < end; ++e) {
    int ids[kNodes];
#pragma unroll
    for (int n = 0; n < kNodes; ++n) ids[n] = ahead[n];
    if (e + 1 < end) load_group(connectivity + std::size_t{next} * kNodes, ahead);
    if (e + 2 < end) next = task.ball_entries[e + 2];
      // The other nodes first.
#pragma unroll
    for (int n = 0; n < kOthers; ++n) {
      if (ids[n] == node) ids[n] = ids[kOthers];
    }
    int places[kOthers];
#pragma unroll
    for (int n = 0; n < kOthers; ++n) places[n] = -1;
    for (int k = 0; k < degree; k += 4) {  // free places hold -1
#pragma unroll
      for (int j = 0; j < 4; ++j) {
        const int entry = row[k + j][t];
#pragma unroll
        for (int n = 0; n < kOthers; ++n) places[n] = entry == ids[n] ? k + j : places[n];
      }
    }
#pragma unroll
    for (int n = 0; n < kOthers; ++n) {
      if (places[n] >= 0) continue;
      if (degree == kRowCapacity) return kTooLong;
      row[degree][t] = ids[n];
      places[n] = degree++;
    }
    if constexpr (kNodes == 3) {
      count_pair(places[0]);
      count_pair(places[1]);
    } else {
      count_pair(pair_index(places[0], places[1]));
      count_pair(pair_index(places[0], places[2]));
      count_pair(pair_index(places[1], places[2]));
    }
  }
  int open = 0;
  for (int w = 0; w < kPairWords; ++w) open |= pairs[w][t] & ~pairs[kPairWords + w][t];
  if (open != 0) task.on_boundary[node] = 1;
  if (overused != 0) task.state->overused_facet = 1;
  return degree;
}

inline constexpr unsigned long long kNoFacet = ~0ULL;

/// Sets of keys, by hash.
template <unsigned int kSlots>
struct RowTables {
  int nodes[kSlots];
  unsigned long long facets[kSlots];  // two more nodes of a facet at the node
  unsigned int facet_counts[kSlots];
  int thirds[kSlots];  // the fourth node of a facet, or -1
  unsigned int node_count, facet_count;
};

/// One warp's search around a node of any mesh. The keys are cut into `parts` by
/// a hash; only those of one part are kept at a time, so that they fit the tables
/// however many there are.
/// kNodes: of the only type of element, a simplex; else 0.
template <int kNodes, unsigned int kSlots>
class RowSearch {
 public:
  using Tables = RowTables<kSlots>;

  __device__ RowSearch(const RowTask& task, Tables& tables, int node, unsigned int parts,
                       unsigned int part)
      : task_(task), tables_(tables), node_(node), parts_(parts), part_(part) {}

  /// Fills the tables from the node's ball; `emit(place, neighbour)` is called
  /// once for every neighbour, place counting from 0. False: more keys than fit.
  template <bool kFacets, class Emit>
  __device__ bool run(const Emit& emit) {
    const unsigned int lane = threadIdx.x % kWarp;
    for (unsigned int slot = lane; slot < kSlots; slot += kWarp) {
      tables_.nodes[slot] = -1;
      tables_.facets[slot] = kNoFacet;
      tables_.facet_counts[slot] = 0;
      tables_.thirds[slot] = kUnset;
    }
    if (lane == 0) tables_.node_count = tables_.facet_count = 0;
    __syncwarp();
    const std::int64_t end = task_.ball_offsets[node_ + 1];
    for (std::int64_t e = task_.ball_offsets[node_] + lane; e < end; e += kWarp) {
      if constexpr (kNodes == 0) {
        add_element<kFacets>(task_.elements[task_.ball_entries[e]], emit);
      } else {
        add_simplex<kFacets>(task_.ball_entries[e], emit);
      }
    }
    __syncwarp();
    return tables_.node_count < kFull && tables_.facet_count < kFull;
  }

  /// Marks the node when it has a facet found once.
  __device__ void mark_boundary() const {
    for (unsigned int slot = threadIdx.x % kWarp; slot < kSlots; slot += kWarp) {
      const unsigned int count = tables_.facet_counts[slot];
      if (count > 2) task_.state->overused_facet = 1;
      if (count == 1) task_.on_boundary[node_] = 1;
    }
    __syncwarp();
  }

  [[nodiscard]] __device__ unsigned int neighbour_count() const { return tables_.node_count; }

 private:
  static constexpr int kUnset = -2;

  /// Keys that are certain to fit, and one more of each lane.
  static constexpr unsigned int kFull = kSlots - kSlots / 8 - kWarp;

  template <bool kFacets, class Emit>
  __device__ void add_simplex(ElementId e, const Emit& emit) {
    constexpr int kOthers = kNodes == 0 ? 1 : kNodes - 1;
    int ids[kNodes == 0 ? 1 : kNodes];
    load_group(task_.elements.runs[0].nodes + std::size_t{e} * kNodes, ids);
#pragma unroll
    for (int n = 0; n < kOthers; ++n) {
      if (ids[n] == node_) ids[n] = ids[kOthers];
    }
#pragma unroll
    for (int n = 0; n < kOthers; ++n) add_neighbour(ids[n], emit);
    if constexpr (kFacets) {
#pragma unroll
      for (int n = 0; n < kOthers; ++n) {
        const int a = ids[n], b = kNodes == 3 ? ids[n] : ids[(n + 1) % kOthers];
        add_facet(min(a, b), max(a, b), -1);
      }
    }
  }

  template <bool kFacets, class Emit>
  __device__ void add_element(const ElementView& element, const Emit& emit) {
    const ElementShape& shape = *element.shape;
    for (int e = 0; e < shape.edge_count; ++e) {
      const NodeId a = element.nodes[shape.edges[e][0]];
      const NodeId b = element.nodes[shape.edges[e][1]];
      if (a == node_) add_neighbour(b, emit);
      if (b == node_) add_neighbour(a, emit);
    }
    for (int f = 0; f < (kFacets ? shape.facet_count : 0); ++f) {
      const FacetKey key = facet_key(element, f);
      int others[3] = {-1, -1, -1};  // ascending, behind them -1
      int count = 0;
      bool here = false;
      for (int n = 4 - shape.facets[f].node_count; n < 4; ++n) {
        if (key.nodes[n] == node_) {
          here = true;
        } else if (count < 3) {
          others[count++] = key.nodes[n];
        }
      }
      if (here) add_facet(others[0], others[1], others[2]);
    }
  }

  template <class Emit>
  __device__ void add_neighbour(int id, const Emit& emit) {
    const unsigned int h = mixed(static_cast<unsigned int>(id));
    if (((h >> 9) & (parts_ - 1)) != part_) return;
    if (*static_cast<volatile unsigned int*>(&tables_.node_count) >= kFull) return;
    for (unsigned int slot = h % kSlots;; slot = (slot + 1) % kSlots) {
      int seen = static_cast<volatile int*>(tables_.nodes)[slot];
      if (seen == -1) {
        seen = atomicCAS(&tables_.nodes[slot], -1, id);
        if (seen == -1) {
          emit(atomicAdd(&tables_.node_count, 1U), id);
          return;
        }
      }
      if (seen == id) return;
    }
  }

  __device__ void add_facet(int first, int second, int third) {
    const unsigned long long key =
        (static_cast<unsigned long long>(first) << 32) | static_cast<unsigned int>(second);
    const unsigned int h =
        mixed(mixed(static_cast<unsigned int>(first)) ^ static_cast<unsigned int>(second)) ^
        mixed(static_cast<unsigned int>(third + 1));
    if (((h >> 9) & (parts_ - 1)) != part_) return;
    if (*static_cast<volatile unsigned int*>(&tables_.facet_count) >= kFull) return;
    for (unsigned int slot = h % kSlots;; slot = (slot + 1) % kSlots) {
      unsigned long long seen = static_cast<volatile unsigned long long*>(tables_.facets)[slot];
      if (seen == kNoFacet) {
        seen = atomicCAS(&tables_.facets[slot], kNoFacet, key);
        if (seen == kNoFacet) {
          atomicExch(&tables_.thirds[slot], third);
          atomicAdd(&tables_.facet_counts[slot], 1U);
          atomicAdd(&tables_.facet_count, 1U);
          return;
        }
      }
      if (seen != key) continue;
      int written = kUnset;  // whoever took the slot is about to write it
      while (written == kUnset) written = atomicOr(&tables_.thirds[slot], 0);
      if (written != third) continue;
      atomicAdd(&tables_.facet_counts[slot], 1U);
      return;
    }
  }

  const RowTask& task_;
  Tables& tables_;
  int node_;
  unsigned int parts_, part_;
};

/// Sums over the blocks before, each as soon as it is known: a decoupled look-back.
/// Source: Merrill, Garland 2016, "Single-pass parallel prefix scan with decoupled
/// look-back".
class LookBack {
 public:
  __device__ LookBack(unsigned long long* words, unsigned int block)
      : words_(words), block_(block) {}

  /// Tells the blocks behind what this one adds; one thread calls, early.
  __device__ void publish(unsigned long long own) const {
    words_[block_] = (block_ == 0 ? kSum : kOwn) | own;
  }
  /// The sum before this block; one whole warp calls, after `publish`.
  __device__ unsigned long long sum_before(unsigned long long own) const {
    const unsigned int lane = threadIdx.x % kWarp;
    unsigned long long before = 0;
    for (std::int64_t last = static_cast<std::int64_t>(block_) - 1; last >= 0; last -= kWarp) {
      const std::int64_t at = last - lane;
      unsigned long long found = kSum;
      if (at >= 0) {
        do {
          found = words_[at];
        } while (found < kOwn);
      }
      __syncwarp();
      const unsigned int sums = __ballot_sync(kAllLanes, found >= kSum);
      const unsigned int used = sums == 0 ? kWarp - 1 : static_cast<unsigned int>(__ffs(sums)) - 1;
      unsigned long long value = lane <= used ? found & kValue : 0;
      for (int step = kWarp / 2; step > 0; step /= 2) {
        value += __shfl_xor_sync(kAllLanes, value, step);
      }
      before += value;
      if (sums != 0) break;
    }
    if (lane == 0 && block_ != 0) words_[block_] = kSum | (before + own);
    return before;
  }

 private:
  static constexpr unsigned long long kOwn = 1ULL << 62, kSum = 2ULL << 62, kValue = kOwn - 1;
  volatile unsigned long long* words_;
  unsigned int block_;
};

/// Sorts the balls of a block's nodes by the caller's elements.
__device__ inline void sort_balls(const RowTask& task, std::size_t first, RowEntries& rows,
                                  RowEntries& keys) {
  const std::size_t own = first + threadIdx.x;
  const bool mine = own < task.node_count;
  const std::int64_t begin = task.ball_offsets[mine ? own : task.node_count];
  const auto size =
      static_cast<unsigned int>(mine ? task.ball_offsets[own + 1] - begin : std::int64_t{0});
  const std::int64_t stretch = __shfl_sync(kAllLanes, begin, 0);
  const ElementId* const names = task.element_names;
  if (__syncthreads_and(size <= kRowCapacity) != 0) {
    const auto start = static_cast<unsigned int>(begin - stretch);
    ElementId* const entries = task.ball_entries + stretch;
    copy_rows<false>(rows, keys, entries, start, size);
    const bool wide = __any_sync(kAllLanes, size > kRowCapacity / 2) != 0;
    sort_own_row(rows, keys, static_cast<int>(size), wide, task.elements.count,
                 [=](int e) { return names == nullptr ? e : names[static_cast<ElementId>(e)]; });
    copy_rows<true>(rows, keys, entries, start, size);
    return;
  }
  for (int r = 0; r < kWarp; ++r) {
    const std::int64_t row = __shfl_sync(kAllLanes, begin, r);
    const unsigned int count = __shfl_sync(kAllLanes, size, r);
    sort_by_warp(task.ball_entries + row, count,
                 [=](ElementId e) { return names == nullptr ? e : names[e]; });
  }
}

/// Rings, boundary and, where they are to be sorted, balls: rows are found in
/// shared memory and put one behind the other by a look-back over the blocks, in
/// one pass.
/// kNodes: of the only type of element, a simplex, whose short rows are found by
/// a thread each; else 0.
/// kBlocks: of a multiprocessor. One more costs registers, and pays where the mesh is so
/// small that all blocks are there at once.
template <int kNodes, int kBlocks = 5>
__global__ void __launch_bounds__(kRowsPerBlock, kBlocks) row_kernel(RowTask task) {
  constexpr int kWarps = kRowsPerBlock / kWarp;
  __shared__ RowEntries rows;
  // The long rows of simplices are few: one warp with large tables.
  constexpr int kSearchers = kNodes == 0 ? kWarps : 1;
  using Search = RowSearch<kNodes, kNodes == 0 ? 128 : 512>;
  __shared__ union {
    RowEntries entries;
    typename Search::Tables tables[kSearchers];
  } scratch;
  __shared__ int degrees[kRowsPerBlock];
  __shared__ unsigned int cuts[kRowsPerBlock];  // parts of a row that is not in `rows`, else 0
  __shared__ unsigned int warp_totals[kWarps];
  __shared__ unsigned long long base;
  __shared__ unsigned int block;
  const unsigned int t = threadIdx.x, warp = t / kWarp, lane = t % kWarp;
  if (t == 0) block = atomicAdd(&task.state->next_block, 1U);
  __syncthreads();
  if (task.state->wrong_element != 0) return;
  const std::size_t first = std::size_t{block} * kRowsPerBlock;
  const std::size_t own = first + t;
  const bool mine = own < task.node_count;

  int degree = mine ? kTooLong : 0;
  if constexpr (kNodes != 0) {
    if (mine) degree = find_simplex_row<kNodes>(task, static_cast<int>(own), rows, scratch.entries);
  }
  degrees[t] = degree;
  cuts[t] = 0;
  if (__syncthreads_or(degree == kTooLong) != 0) {
    for (unsigned int r = warp; r < kRowsPerBlock; r += kSearchers) {
      if (warp >= kSearchers || degrees[r] != kTooLong) continue;
      unsigned int found = 0, parts = 1;
      for (bool fits = false; !fits;) {
        fits = true;
        found = 0;
        for (unsigned int part = 0; part < parts && fits; ++part) {
          Search search(task, scratch.tables[warp], static_cast<int>(first + r), parts, part);
          fits = search.template run<true>([&](unsigned int place, int id) {
            if (place < kRowCapacity) rows[place][r] = id;
          });
          if (fits) search.mark_boundary();
          found += search.neighbour_count();
          __syncwarp();
        }
        if (!fits) parts *= 2;
      }
      if (lane == 0) {
        degrees[r] = static_cast<int>(found);
        cuts[r] = parts > 1 || found > kRowCapacity ? parts : 0;
      }
    }
    __syncthreads();
  }
  degree = degrees[t];
  const bool is_short = cuts[t] == 0;
  // Where the rows go.
  unsigned int sum = static_cast<unsigned int>(degree);  // up to and with this row
  for (int step = 1; step < kWarp; step *= 2) {
    const unsigned int lower = __shfl_up_sync(kAllLanes, sum, step);
    if (lane >= static_cast<unsigned int>(step)) sum += lower;
  }
  if (lane == kWarp - 1) warp_totals[warp] = sum;
  __syncthreads();
  unsigned int before_warp = 0, total = 0;
  for (unsigned int w = 0; w < kWarps; ++w) {
    if (w < warp) before_warp += warp_totals[w];
    total += warp_totals[w];
  }
  // Nobody shall wait for what is still to be done here.
  const LookBack look_back(task.look_back, block);
  if (t == 0) look_back.publish(total);
  const bool wide = __any_sync(kAllLanes, is_short && degree > kRowCapacity / 2) != 0;
  if (is_short) {
    sort_own_row(rows, scratch.entries, degree, wide, task.node_count,
                 [&](int node) { return task.caller_of[node]; });
  }
  if (warp == 0) {
    __syncwarp();
    const unsigned long long before = look_back.sum_before(total);
    if (lane == 0) base = before;
  }
  __syncthreads();
  const unsigned int start = sum - static_cast<unsigned int>(degree);  // in the warp's stretch
  const unsigned long long stretch = base + before_warp;
  const unsigned long long place = stretch + start;
  if (mine) task.offsets[own] = static_cast<std::int64_t>(place);
  if (own + 1 == task.node_count) {
    task.offsets[own + 1] = static_cast<std::int64_t>(place + degree);
    task.state->ring_entries = place + degree;
  }
  const bool room = base + total <= task.capacity;  // else the host will see and call again
  const bool all_short = __syncthreads_and(is_short) != 0;
  if (room && all_short) {
    copy_rows<true>(rows, scratch.entries, task.entries + stretch, start,
                    static_cast<unsigned int>(degree));
  } else if (room) {
    if (is_short) {
      for (int k = 0; k < degree; ++k) task.entries[place + k] = rows[k][t];
    }
    __syncthreads();
    for (unsigned int r = warp; r < kRowsPerBlock; r += kSearchers) {
      const unsigned int parts = cuts[r];
      if (warp >= kSearchers || parts == 0) continue;
      NodeId* const row = task.entries + task.offsets[first + r];
      const NodeId* const caller_of = task.caller_of;
      typename Search::Tables& tables = scratch.tables[warp];
      if (parts == 1) {
        // The tables of facets are free: the row is sorted there by pairs of key and entry.
        Search search(task, tables, static_cast<int>(first + r), 1, 0);
        search.template run<false>([&](unsigned int at, int id) {
          tables.facets[at] =
              static_cast<unsigned long long>(caller_of[id]) << 32 | static_cast<unsigned int>(id);
        });
        const unsigned int found = search.neighbour_count();
        sort_by_warp(tables.facets, found, [](unsigned long long pair) { return pair; });
        for (unsigned int at = lane; at < found; at += kWarp) {
          row[at] = static_cast<NodeId>(tables.facets[at] & 0xffffffffULL);
        }
        __syncwarp();
        continue;
      }
      unsigned int found = 0;
      for (unsigned int part = 0; part < parts; ++part) {
        Search search(task, tables, static_cast<int>(first + r), parts, part);
        search.template run<false>([&](unsigned int at, int id) { row[found + at] = id; });
        found += search.neighbour_count();
        __syncwarp();
      }
      sort_by_warp(row, found, [=](NodeId n) { return caller_of[n]; });
    }
    __syncthreads();
  }
  if (task.sort_balls) sort_balls(task, first, rows, scratch.entries);
}

}  // namespace meshsmooth::detail
