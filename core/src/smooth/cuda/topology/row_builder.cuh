#pragma once

#include <array>
#include <type_traits>
#include <utility>

#include "smooth/cuda/device/cuda_executor.cuh"
#include "smooth/cuda/topology/ball_plan.hpp"
#include "smooth/cuda/topology/prepare_state.hpp"
#include "smooth/rules/facet_key.hpp"
#include "smooth/rules/fixed_nodes.hpp"
#include "smooth/rules/topology.hpp"

namespace meshsmooth::detail {

/// Balls of a fixed number of places, those of 32 nodes side by side, so that nobody needs to know
/// before where a row begins: they are filled while the elements are still on their way.
struct BallSlots {
  static constexpr std::uint32_t kCount = BallPlan::kSlots;
  ElementId* entries = nullptr;
  const std::uint32_t* sizes = nullptr;  // may be above kCount

  static constexpr std::size_t size(std::size_t node_count) {
    return (node_count + kWarp - 1) / kWarp * kWarp * kCount;
  }
  [[nodiscard]] __device__ ElementId* row(std::size_t node) const {
    return entries + (node / kWarp * kWarp * kCount + node % kWarp);
  }
};

/// Rings, boundary and the nodes that stay, from the balls.
struct RowTask {
  std::size_t node_count;
  Elements elements;
  BallSlots slots;             // where the balls are, unless they are in rows already
  std::int64_t* ball_offsets;  // of rows
  ElementId* ball_entries;
  const NodeId* caller_ids;        // of nodes
  const ElementId* element_names;  // caller's element of an element; null: the same
  bool keep_balls;                 // in rows, sorted
  std::int64_t* offsets;
  NodeId* entries;
  std::size_t capacity;           // entries that there is room for
  FixRule hold;                   // of marks that are all 0 before
  unsigned long long* look_back;  // one word a block, 0 before
  PrepareState* state;
  PrepareState* seen;  // becomes a copy of it, for the host
};

/// The ball of a node.
class BallRow {
 public:
  __device__ BallRow(const RowTask& task, std::size_t node) {
    if (task.slots.entries != nullptr) {
      entries_ = task.slots.row(node);
      size_ = min(task.slots.sizes[node], BallSlots::kCount);
      stride_ = kWarp;
    } else {
      const std::int64_t begin = task.ball_offsets[node];
      entries_ = task.ball_entries + begin;
      size_ = static_cast<std::uint32_t>(task.ball_offsets[node + 1] - begin);
      stride_ = 1;
    }
  }
  [[nodiscard]] __device__ std::uint32_t size() const { return size_; }
  [[nodiscard]] __device__ ElementId operator[](std::uint32_t k) const {
    return entries_[std::size_t{k} * stride_];
  }

 private:
  const ElementId* entries_;
  std::uint32_t size_, stride_;
};

inline constexpr int kRowsPerBlock = 128;  // as many threads
inline constexpr int kPlaceBits = 5;
inline constexpr int kRowCapacity = 1 << kPlaceBits;  // longer rows are a case for `RowSearch`
/// So many keys or more are too many for one and a place in one word.
inline constexpr std::size_t kManyKeys = (std::size_t{1} << (32 - kPlaceBits)) - 1;

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
  if (key_count < kManyKeys) {
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

/// Of the shared memory of a block, what a warp has for its rows one behind the other.
inline constexpr unsigned int kStaged = kRowCapacity * kWarp;
__device__ inline int* stage_of_warp(RowEntries& scratch) {
  return &scratch[0][0] + threadIdx.x / kWarp * kStaged;
}

/// Copies the rows of a warp's threads to the stretch of memory in which they lie one behind the
/// other, in whole lines. `column` is where the thread's row is, `start` its place in the stretch;
/// no row is longer than kRowCapacity.
template <class Id>
__device__ void store_rows(const RowEntries& rows, unsigned int column, RowEntries& scratch,
                           Id* stretch, unsigned int start, unsigned int count) {
  int* const staged = stage_of_warp(scratch);
  const unsigned int total = __shfl_sync(kAllLanes, start + count, kWarp - 1);
  __syncthreads();  // the scratch of all warps is one
  for (unsigned int k = 0; k < count; ++k) staged[start + k] = rows[k][column];
  __syncwarp();
  for (unsigned int i = threadIdx.x % kWarp; i < total; i += kWarp) {
    stretch[i] = static_cast<Id>(staged[i]);
  }
  __syncthreads();
}

inline constexpr int kTooLong = -1;  // in place of a degree

/// How often each facet at a node was seen, for the row's own thread: a matrix of bits by the
/// places of a facet's other nodes, below the diagonal whether the number is odd, above it whether
/// it is not 0. Those two tell 0, 1 and 2 uses apart, and together with the number of all uses
/// that there are no others.
class FacetUses {
 public:
  __device__ explicit FacetUses(RowEntries& bits) : bits_(bits) {
    for (int k = 0; k < kRowCapacity; ++k) bits_[k][threadIdx.x] = 0;
  }
  /// By atomics, though the words are the thread's own: nothing waits for what they give.
  __device__ void add(unsigned int a, unsigned int b) {
    const unsigned int low = min(a, b), high = max(a, b);
    atomicXor(&bits_[high][threadIdx.x], 1 << low);
    atomicOr(&bits_[low][threadIdx.x], 1 << high);
  }
  /// Facets used an odd number of times, and those used at all.
  struct Counts {
    int odd = 0, used = 0;
  };
  [[nodiscard]] __device__ Counts count(int row_size) const {
    Counts counts;
    for (int k = 0; k < row_size; ++k) {
      const auto bits = static_cast<unsigned int>(bits_[k][threadIdx.x]);
      const unsigned int below = (1U << k) - 1;
      counts.odd += __popc(bits & below);
      counts.used += __popc(bits & ~below);
    }
    return counts;
  }

 private:
  static_assert(kRowCapacity <= 32);
  RowEntries& bits_;
};

/// Ring and boundary mark of this thread's node; the row is left unsorted in
/// `row`. Returns the degree, or kTooLong.
///
/// A facet at the node is a pair of its neighbours (in a surface one neighbour, here with
/// the node itself in the row's first place). Nothing but node ids is ever compared: an entry is
/// an id and its place in one word, of which is subtracted what is searched for, so that the
/// lowest difference is the place where it is found.
template <int kNodes>
__device__ int find_simplex_row(const RowTask& task, int node, RowEntries& row, RowEntries& bits) {
  const unsigned int t = threadIdx.x;
  constexpr int kOthers = kNodes - 1;
  constexpr int kFirst = kNodes == 3 ? 1 : 0;  // place of the first neighbour
  FacetUses uses(bits);
  for (int k = 0; k < kRowCapacity; ++k) row[k][t] = -1;
  int end_place = kFirst;
  const NodeId* const connectivity = task.elements.runs[0].nodes;
  const BallRow ball(task, static_cast<std::size_t>(node));
  // Elements that are looked at together: the row is read once for all their nodes.
  constexpr int kAtOnce = 2;
  // Two loads that hang on each other are on their way meanwhile. Behind the last element comes
  // the last again.
  int ahead[kAtOnce][kNodes];
  ElementId next[kAtOnce];
  const auto find = [&](std::uint32_t e) {
#pragma unroll
    for (int h = 0; h < kAtOnce; ++h) next[h] = ball[min(e + h, ball.size() - 1)];
  };
  const auto load = [&] {
#pragma unroll
    for (int h = 0; h < kAtOnce; ++h) {
      load_group(connectivity + std::size_t{next[h]} * kNodes, ahead[h]);
    }
  };
  if (ball.size() > 0) {
    find(0);
    load();
    find(kAtOnce);
  }
  for (std::uint32_t e = 0; e < ball.size(); e += kAtOnce) {
    unsigned int words[kAtOnce][kOthers], places[kAtOnce][kOthers];
#pragma unroll
    for (int h = 0; h < kAtOnce; ++h) {
#pragma unroll
      for (int n = 0; n < kOthers; ++n) {
        const int id = ahead[h][n] == node ? ahead[h][kOthers] : ahead[h][n];
        words[h][n] = static_cast<unsigned int>(id) << kPlaceBits;
        places[h][n] = ~0U;
      }
    }
    load();
    find(e + 2 * kAtOnce);
    // As far as the longest of the warp's rows: free places hold no id.
#if __CUDA_ARCH__ >= 800
    const int most = min(__reduce_max_sync(__activemask(), end_place), kRowCapacity);
#else
    constexpr int most = kRowCapacity;
#endif
#pragma unroll 1
    for (int k = 0; k < most; k += 8) {
#pragma unroll
      for (int j = 0; j < 8; ++j) {
        const auto entry = static_cast<unsigned int>(row[k + j][t]);
#pragma unroll
        for (int h = 0; h < kAtOnce; ++h) {
#pragma unroll
          for (int n = 0; n < kOthers; ++n) {
            places[h][n] = __viaddmin_u32(entry, 0U - words[h][n], places[h][n]);
          }
        }
      }
    }
#pragma unroll
    for (int h = 0; h < kAtOnce; ++h) {
#pragma unroll
      for (int n = 0; n < kOthers; ++n) {
        unsigned int& place = places[h][n];
#pragma unroll
        for (int m = 0; m < h * kOthers; ++m) {
          if (words[m / kOthers][m % kOthers] == words[h][n]) {
            place = places[m / kOthers][m % kOthers];
          }
        }
        const bool is_new = place >= kRowCapacity;
        if (is_new) place = static_cast<unsigned int>(min(end_place, kRowCapacity - 1));
        if (is_new) row[place][t] = static_cast<int>(words[h][n] | place);
        end_place += is_new ? 1 : 0;
      }
      if (e + h >= ball.size()) continue;
      if constexpr (kNodes == 3) {
        uses.add(0, places[h][0]);
        uses.add(0, places[h][1]);
      } else {
        uses.add(places[h][0], places[h][1]);
        uses.add(places[h][0], places[h][2]);
        uses.add(places[h][1], places[h][2]);
      }
    }
  }
  if (end_place > kRowCapacity) return kTooLong;
  const FacetUses::Counts counts = uses.count(end_place);
  const std::uint32_t all_uses = ball.size() * (kNodes == 3 ? 2 : 3);
  if (counts.odd != 0) task.hold.fixed[node] = 1;
  if (all_uses != static_cast<std::uint32_t>(2 * counts.used - counts.odd))
    task.state->overused_facet = 1;
  const int degree = end_place - kFirst;
  for (int k = 0; k < degree; ++k) {
    row[k][t] = static_cast<int>(static_cast<unsigned int>(row[k + kFirst][t]) >> kPlaceBits);
  }
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

/// The search of a warp or a whole block around a node of any mesh. The keys are cut into `parts`
/// by a hash; only those of one part are kept at a time, so that they fit the tables
/// however many there are.
/// kNodes: of the only type of element, a simplex; else 0.
template <int kNodes, unsigned int kThreads, unsigned int kSlots>
class RowSearch {
 public:
  using Tables = RowTables<kSlots>;

  /// Waits for the others of the search.
  static __device__ void sync() {
    if constexpr (kThreads == kWarp) {
      __syncwarp();
    } else {
      __syncthreads();
    }
  }

  __device__ RowSearch(const RowTask& task, Tables& tables, int node, unsigned int parts,
                       unsigned int part)
      : task_(task), tables_(tables), node_(node), parts_(parts), part_(part) {}

  /// Fills the tables from the node's ball; `emit(place, neighbour)` is called
  /// once for every neighbour, place counting from 0. False: more keys than fit.
  template <bool kFacets, class Emit>
  __device__ bool run(const Emit& emit) {
    const unsigned int rank = threadIdx.x % kThreads;
    for (unsigned int slot = rank; slot < kSlots; slot += kThreads) {
      tables_.nodes[slot] = -1;
      tables_.facets[slot] = kNoFacet;
      tables_.facet_counts[slot] = 0;
      tables_.thirds[slot] = kUnset;
    }
    if (rank == 0) tables_.node_count = tables_.facet_count = 0;
    sync();
    const BallRow ball(task_, static_cast<std::size_t>(node_));
    for (std::uint32_t e = rank; e < ball.size(); e += kThreads) {
      if constexpr (kNodes == 0) {
        add_element<kFacets>(task_.elements[ball[e]], emit);
      } else {
        add_simplex<kFacets>(ball[e], emit);
      }
    }
    sync();
    return tables_.node_count < kFull && tables_.facet_count < kFull;
  }

  /// Marks the node when it has a facet found once.
  __device__ void mark_boundary() const {
    for (unsigned int slot = threadIdx.x % kThreads; slot < kSlots; slot += kThreads) {
      const unsigned int count = tables_.facet_counts[slot];
      if (count > 2) task_.state->overused_facet = 1;
      if (count == 1) task_.hold.fixed[node_] = 1;
    }
    sync();
  }

  [[nodiscard]] __device__ unsigned int neighbour_count() const { return tables_.node_count; }

 private:
  static constexpr int kUnset = -2;

  /// Keys that are certain to fit, and one more of each thread.
  static constexpr unsigned int kFull = kSlots - kSlots / 8 - kThreads;

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

/// Brings the balls of a block's nodes to their rows, sorted by the caller's elements.
__device__ inline void keep_balls(const RowTask& task, std::size_t first, RowEntries& rows,
                                  RowEntries& scratch) {
  const std::size_t own = first + threadIdx.x;
  const bool mine = own < task.node_count;
  const unsigned int lane = threadIdx.x % kWarp;
  const std::int64_t begin = task.ball_offsets[mine ? own : task.node_count];
  const auto size =
      static_cast<unsigned int>(mine ? task.ball_offsets[own + 1] - begin : std::int64_t{0});
  const std::int64_t stretch = __shfl_sync(kAllLanes, begin, 0);
  const auto start = static_cast<unsigned int>(begin - stretch);
  const unsigned int total = __shfl_sync(kAllLanes, start + size, kWarp - 1);
  ElementId* const entries = task.ball_entries + stretch;
  const ElementId* const names = task.element_names;
  const bool slotted = task.slots.entries != nullptr;
  const auto fetch_slots = [&](auto* to) {
    if (!slotted || !mine) return;
    const BallRow ball(task, own);
    for (unsigned int k = 0; k < ball.size(); ++k) {
      to[start + k] = static_cast<std::remove_reference_t<decltype(*to)>>(ball[k]);
    }
  };
  __syncthreads();  // what was in shared memory is of no use any more
  if (total > kStaged || task.elements.count >= kManyKeys) {
    fetch_slots(entries);
    __syncwarp();
    for (int r = 0; r < kWarp; ++r) {
      sort_by_warp(entries + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r),
                   [=](ElementId e) { return names == nullptr ? e : names[e]; });
    }
    return;
  }
  int* const staged = stage_of_warp(scratch);
  fetch_slots(staged);
  for (unsigned int i = lane; i < total && !slotted; i += kWarp) {
    staged[i] = static_cast<int>(entries[i]);
  }
  __syncwarp();
  const auto name_of = [=](int e) {
    return names == nullptr ? static_cast<ElementId>(e) : names[static_cast<ElementId>(e)];
  };
  // Short rows by a thread each, the others by all.
  const unsigned int own_size = size <= kRowCapacity ? size : 0;
  const bool wide = __any_sync(kAllLanes, own_size > kRowCapacity / 2) != 0;
  for (unsigned int k = 0; k < own_size; ++k) rows[k][threadIdx.x] = staged[start + k];
  sort_own_row(rows, scratch, static_cast<int>(own_size), wide, task.elements.count, name_of);
  for (unsigned int k = 0; k < own_size; ++k) staged[start + k] = rows[k][threadIdx.x];
  __syncwarp();
  for (unsigned int left = __ballot_sync(kAllLanes, own_size < size); left != 0; left &= left - 1) {
    const int r = __ffs(static_cast<int>(left)) - 1;
    sort_by_warp(staged + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r),
                 name_of);
  }
  for (unsigned int i = lane; i < total; i += kWarp) entries[i] = static_cast<ElementId>(staged[i]);
}

/// Which of a block's nodes a thread searches: those with the largest balls go to one warp and so
/// on, so that the threads of a warp have about as much to do. All threads call.
__device__ inline unsigned int share_by_ball_size(const RowTask& task, std::size_t first,
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
  const unsigned int place = atomicAdd(&begins[bin], 1U);
  __syncthreads();
  if (t < kWarp) {
    const unsigned int low = begins[2 * lane], both = low + begins[2 * lane + 1];
    unsigned int sum = both;
    for (int step = 1; step < kWarp; step *= 2) {
      const unsigned int lower = __shfl_up_sync(kAllLanes, sum, step);
      if (lane >= static_cast<unsigned int>(step)) sum += lower;
    }
    begins[2 * lane] = sum - both;
    begins[2 * lane + 1] = sum - both + low;
  }
  __syncthreads();
  order[begins[bin] + place] = static_cast<unsigned char>(t);
  __syncthreads();
  // Warps of one number share a scheduler: of blocks that are on one multiprocessor, which are
  // about so many apart, each has its largest balls elsewhere.
  constexpr unsigned int kApart = 128;
  return order[(t + block / kApart * kWarp) % kRowsPerBlock];
}

/// Decides whether the nodes of a block stay, each by its thread, and counts them; all threads
/// call.
__device__ inline void hold_own(const RowTask& task, std::size_t own, int degree) {
  FixedCounts counts;
  if (own < task.node_count) counts = task.hold(own, degree == 0);
  const auto add = [](unsigned long long& total, bool counted) {
    const int count = __syncthreads_count(counted);
    if (threadIdx.x == 0 && count > 0) atomicAdd(&total, static_cast<unsigned long long>(count));
  };
  add(task.state->boundary, counts.nodes.boundary != 0);
  add(task.state->held, counts.nodes.fixed != 0);
  add(task.state->isolated, counts.nodes.isolated != 0);
  add(task.state->free, counts.free != 0);
}

/// The last block that ends has the state copied for the host. One thread of each calls, once the
/// others have said what they have to say.
__device__ inline void end_block(const RowTask& task) {
  __threadfence();
  if (atomicAdd(&task.state->blocks_done, 1U) + 1 != gridDim.x) return;
  __threadfence();
  using Word = unsigned long long;
  static_assert(sizeof(PrepareState) % sizeof(Word) == 0);
  const volatile Word* const from = reinterpret_cast<const volatile Word*>(task.state);
  for (std::size_t w = 0; w < sizeof(PrepareState) / sizeof(Word); ++w) {
    reinterpret_cast<Word*>(task.seen)[w] = from[w];
  }
}

/// Rings, boundary, the nodes that stay and, where they are kept, balls: rows are found in
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
  // The long rows of simplices are few: the whole block searches, with large tables.
  constexpr int kSearchers = kNodes == 0 ? kWarps : 1;
  constexpr unsigned int kSearcherSize = kRowsPerBlock / kSearchers;
  using Search = RowSearch<kNodes, kSearcherSize, kNodes == 0 ? 128 : 512>;
  __shared__ union {
    RowEntries entries;
    typename Search::Tables tables[kSearchers];
  } scratch;
  __shared__ int degrees[kRowsPerBlock];
  __shared__ unsigned char columns[kRowsPerBlock];    // of `rows`, in which a node's row is
  __shared__ unsigned char long_rows[kRowsPerBlock];  // of which `RowSearch` is to find out
  __shared__ unsigned int long_count;
  __shared__ unsigned int cuts[kRowsPerBlock];  // parts of a row that is not in `rows`, else 0
  __shared__ unsigned int warp_totals[kWarps];
  __shared__ unsigned long long base;
  __shared__ unsigned int block;
  const unsigned int t = threadIdx.x, warp = t / kWarp, lane = t % kWarp;
  const unsigned int searcher = t / kSearcherSize, rank = t % kSearcherSize;
  if (t == 0) {
    block = atomicAdd(&task.state->next_block, 1U);
    long_count = 0;
  }
  __syncthreads();
  const std::size_t first = std::size_t{block} * kRowsPerBlock;
  const std::size_t own = first + t;
  const bool mine = own < task.node_count;
  if (task.state->wrong_element != 0 || task.state->overfull_ball != 0) {
    if (mine) task.offsets[own] = task.offsets[own + 1] = 0;
    if (t == 0) end_block(task);
    return;
  }

  unsigned int searched = t;  // the thread's own row until it is copied
  if constexpr (kNodes != 0) searched = share_by_ball_size(task, first, block);
  int degree = 0;
  if (first + searched < task.node_count) {
    if constexpr (kNodes == 0) {
      degree = kTooLong;
    } else {
      degree =
          find_simplex_row<kNodes>(task, static_cast<int>(first + searched), rows, scratch.entries);
    }
  }
  degrees[searched] = degree;
  columns[searched] = static_cast<unsigned char>(t);
  cuts[t] = 0;
  if (degree == kTooLong) {
    long_rows[atomicAdd(&long_count, 1U)] = static_cast<unsigned char>(searched);
  }
  if (__syncthreads_or(degree == kTooLong) != 0) {
    for (unsigned int at = searcher; at < long_count; at += kSearchers) {
      const unsigned int r = long_rows[at];
      unsigned int found = 0, parts = 1;
      for (bool fits = false; !fits;) {
        fits = true;
        found = 0;
        for (unsigned int part = 0; part < parts && fits; ++part) {
          Search search(task, scratch.tables[searcher], static_cast<int>(first + r), parts, part);
          fits = search.template run<true>([&](unsigned int place, int id) {
            if (place < kRowCapacity) rows[place][columns[r]] = id;
          });
          if (fits) search.mark_boundary();
          found += search.neighbour_count();
          Search::sync();
        }
        if (!fits) parts *= 2;
      }
      if (rank == 0) {
        degrees[r] = static_cast<int>(found);
        cuts[r] = parts > 1 || found > kRowCapacity ? parts : 0;
      }
    }
    __syncthreads();
  }
  degree = degrees[t];
  hold_own(task, own, degree);
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
  const int searched_degree = cuts[searched] == 0 ? degrees[searched] : 0;
  const bool wide = __any_sync(kAllLanes, searched_degree > kRowCapacity / 2) != 0;
  sort_own_row(rows, scratch.entries, searched_degree, wide, task.node_count,
               [&](int node) { return task.caller_ids[node]; });
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
  if (t == 0) end_block(task);
  if (room && all_short) {
    store_rows(rows, columns[t], scratch.entries, task.entries + stretch, start,
               static_cast<unsigned int>(degree));
  } else if (room) {
    if (is_short) {
      for (int k = 0; k < degree; ++k) task.entries[place + k] = rows[k][columns[t]];
    }
    __syncthreads();
    for (unsigned int at = searcher; at < long_count; at += kSearchers) {
      const unsigned int r = long_rows[at];
      const unsigned int parts = cuts[r];
      if (parts == 0) continue;
      NodeId* const row = task.entries + task.offsets[first + r];
      const NodeId* const caller_ids = task.caller_ids;
      typename Search::Tables& tables = scratch.tables[searcher];
      if (parts == 1) {
        // The tables of facets are free: the row is sorted there by pairs of key and entry.
        Search search(task, tables, static_cast<int>(first + r), 1, 0);
        search.template run<false>([&](unsigned int at, int id) {
          tables.facets[at] =
              static_cast<unsigned long long>(caller_ids[id]) << 32 | static_cast<unsigned int>(id);
        });
        const unsigned int found = search.neighbour_count();
        if (rank < kWarp) {
          sort_by_warp(tables.facets, found, [](unsigned long long pair) { return pair; });
        }
        Search::sync();
        for (unsigned int k = rank; k < found; k += kSearcherSize) {
          row[k] = static_cast<NodeId>(tables.facets[k] & 0xffffffffULL);
        }
        Search::sync();
        continue;
      }
      unsigned int found = 0;
      for (unsigned int part = 0; part < parts; ++part) {
        Search search(task, tables, static_cast<int>(first + r), parts, part);
        search.template run<false>([&](unsigned int at, int id) { row[found + at] = id; });
        found += search.neighbour_count();
        Search::sync();
      }
      if (rank < kWarp) sort_by_warp(row, found, [=](NodeId n) { return caller_ids[n]; });
    }
    __syncthreads();
  }
  if (task.keep_balls) keep_balls(task, first, rows, scratch.entries);
}

}  // namespace meshsmooth::detail
