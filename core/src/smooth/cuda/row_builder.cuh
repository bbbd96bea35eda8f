#pragma once

#include "smooth/boundary.hpp"
#include "smooth/cuda/cuda_executor.cuh"
#include "smooth/topology.hpp"

namespace meshsmooth::detail {

/// What the kernels of `prepare_job` tell the host.
struct PrepareState {
  unsigned long long lower[3], upper[3];  // of the box, as `ordered_bits`
  unsigned int wrong_position = 0;
  unsigned int wrong_element = 0;
  unsigned int overused_facet = 0;
  unsigned int next_block = 0;
  unsigned long long ring_entries = 0;
};

/// Rings and boundary, from the balls.
struct RowTask {
  std::size_t node_count;
  Elements elements;
  std::int64_t* ball_offsets;
  ElementId* ball_entries;
  const NodeId* caller_of;        // of nodes
  const ElementId* element_names;  // caller's element of an element; null: the same
  bool sort_balls;
  std::int64_t* offsets;
  NodeId* entries;
  std::size_t capacity;  // entries that there is room for
  std::uint8_t* on_boundary;
  unsigned long long* look_back;  // one word a block, 0 before
  PrepareState* state;
};

inline constexpr int kWarp = 32;
inline constexpr int kRowsPerBlock = 32;
inline constexpr int kWarpsPerBlock = kBlockSize / kWarp;
inline constexpr int kRowCapacity = 64;     // longer rows are found twice
inline constexpr int kTableSize = 128;      // slots
inline constexpr unsigned int kFull = 80;   // + one insertion of each lane still fits
inline constexpr unsigned long long kNoFacet = ~0ULL;

/// What one warp works with: sets of at most kFull keys.
template <bool kThird>
struct RowTables {
  int nodes[kTableSize];
  unsigned long long facets[kTableSize];  // the two nodes after the lowest
  unsigned int facet_counts[kTableSize];
  int thirds[kThird ? kTableSize : 1];  // the fourth node of a facet
  unsigned int node_count, facet_count;
};

__device__ inline unsigned int mixed(unsigned int h) {
  h *= 0x9e3779b1U;
  h = (h ^ (h >> 15)) * 0x85ebca6bU;
  return h ^ (h >> 13);
}

/// Sorts by a whole warp, in place. Bitonic merges whose missing entries count as
/// the highest, so that any count will do. O(count log^2 count / 32).
template <class Id, class Key>
__device__ void sort_row_by_warp(Id* row, unsigned int count, const Key& key) {
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

/// Sorts at most kRowCapacity entries by a whole warp; each counts the lower
/// ones. `keys` is scratch.
template <class Id, class Key>
__device__ void rank_row_by_warp(Id* row, unsigned int count, int* keys, const Key& key) {
  constexpr int kEach = kRowCapacity / kWarp;
  const unsigned int lane = threadIdx.x % kWarp;
  Id own[kEach];
  int own_key[kEach];
#pragma unroll
  for (int n = 0; n < kEach; ++n) {
    const unsigned int i = lane + n * kWarp;
    if (i < count) {
      own[n] = row[i];
      keys[i] = own_key[n] = static_cast<int>(key(own[n]));
    }
  }
  __syncwarp();
#pragma unroll
  for (int n = 0; n < kEach; ++n) {
    if (lane + n * kWarp >= count) continue;
    unsigned int lower = 0;
    for (unsigned int j = 0; j < count; ++j) {
      lower += static_cast<unsigned int>(keys[j]) < static_cast<unsigned int>(own_key[n]) ? 1 : 0;
    }
    row[lower] = own[n];
  }
  __syncwarp();
}

/// One warp's search around one node. The keys are cut into `parts` by a hash;
/// only those of one part are kept at a time, so that they fit the tables
/// however many there are.
/// kNodes: of the only type of element, a simplex; else 0.
template <int kNodes>
class RowSearch {
 public:
  using Tables = RowTables<kNodes == 0>;

  __device__ RowSearch(const RowTask& task, Tables& tables, int node, unsigned int parts,
                       unsigned int part)
      : task_(task), tables_(tables), node_(node), parts_(parts), part_(part) {}

  /// Fills the tables from the node's ball; `emit(place, neighbour)` is called
  /// once for every neighbour, place counting from 0. False: more keys than fit.
  template <class Emit>
  __device__ bool run(const Emit& emit) {
    const unsigned int lane = threadIdx.x % kWarp;
    for (unsigned int slot = lane; slot < kTableSize; slot += kWarp) {
      tables_.nodes[slot] = -1;
      tables_.facets[slot] = kNoFacet;
      tables_.facet_counts[slot] = 0;
      if constexpr (kNodes == 0) tables_.thirds[slot] = kUnset;
    }
    if (lane == 0) tables_.node_count = tables_.facet_count = 0;
    __syncwarp();
    const std::int64_t end = task_.ball_offsets[node_ + 1];
    for (std::int64_t e = task_.ball_offsets[node_] + lane; e < end; e += kWarp) {
      if constexpr (kNodes == 0) {
        add_element(task_.elements[task_.ball_entries[e]], emit);
      } else {
        add_simplex(task_.elements.runs[0].nodes + std::size_t{task_.ball_entries[e]} * kNodes,
                    emit);
      }
    }
    __syncwarp();
    return tables_.node_count < kFull && tables_.facet_count < kFull;
  }

  /// Marks the nodes of facets found once.
  __device__ void mark_boundary() const {
    for (unsigned int slot = threadIdx.x % kWarp; slot < kTableSize; slot += kWarp) {
      const unsigned int count = tables_.facet_counts[slot];
      if (count > 2) task_.state->overused_facet = 1;
      if (count != 1) continue;
      const unsigned long long facet = tables_.facets[slot];
      task_.on_boundary[node_] = 1;
      task_.on_boundary[facet >> 32] = 1;
      task_.on_boundary[facet & 0xffffffffU] = 1;
      if constexpr (kNodes == 0) {
        if (tables_.thirds[slot] >= 0) task_.on_boundary[tables_.thirds[slot]] = 1;
      }
    }
    __syncwarp();
  }

  [[nodiscard]] __device__ unsigned int neighbour_count() const { return tables_.node_count; }

 private:
  static constexpr int kUnset = -2;

  template <class Emit>
  __device__ void add_simplex(const NodeId* nodes, const Emit& emit) {
    int higher[4];  // the nodes above this one
    int count = 0;
    int others[kNodes == 0 ? 1 : kNodes];
#pragma unroll
    for (int n = 0; n < kNodes; ++n) others[n] = nodes[n];
#pragma unroll
    for (int n = 0; n < kNodes; ++n) {
      if (others[n] != node_) add_neighbour(others[n], emit);
      if (others[n] > node_) higher[count++] = others[n];
    }
    if constexpr (kNodes == 3) {
      for (int n = 0; n < count; ++n) add_facet(higher[n], higher[n], -1);
    } else {
      if (count >= 2) add_facet(higher[0], higher[1], -1);
      if (count == 3) {
        add_facet(higher[0], higher[2], -1);
        add_facet(higher[1], higher[2], -1);
      }
    }
  }

  template <class Emit>
  __device__ void add_element(const ElementView& element, const Emit& emit) {
    const ElementShape& shape = *element.shape;
    for (int e = 0; e < shape.edge_count; ++e) {
      const NodeId a = element.nodes[shape.edges[e][0]];
      const NodeId b = element.nodes[shape.edges[e][1]];
      if (a == node_) add_neighbour(b, emit);
      if (b == node_) add_neighbour(a, emit);
    }
    for (int f = 0; f < shape.facet_count; ++f) {
      const FacetKey key = facet_key(element, f);
      const int skipped = 4 - shape.facets[f].node_count;
      if (key.nodes[skipped] != node_) continue;
      const int second = key.nodes[skipped + 1];
      add_facet(second, skipped < 2 ? key.nodes[skipped + 2] : second,
                skipped == 0 ? key.nodes[3] : -1);
    }
  }

  template <class Emit>
  __device__ void add_neighbour(int id, const Emit& emit) {
    const unsigned int h = mixed(static_cast<unsigned int>(id));
    if (((h >> 7) & (parts_ - 1)) != part_) return;
    if (*static_cast<volatile unsigned int*>(&tables_.node_count) >= kFull) return;
    for (unsigned int slot = h % kTableSize;; slot = (slot + 1) % kTableSize) {
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

  __device__ void add_facet(int a, int b, int third) {
    const unsigned long long key =
        (static_cast<unsigned long long>(a < b ? a : b) << 32) |
        static_cast<unsigned int>(a < b ? b : a);
    const unsigned int h = mixed(mixed(static_cast<unsigned int>(key >> 32)) ^
                                 static_cast<unsigned int>(key)) ^
                           mixed(static_cast<unsigned int>(third + 1));
    if (((h >> 7) & (parts_ - 1)) != part_) return;
    if (*static_cast<volatile unsigned int*>(&tables_.facet_count) >= kFull) return;
    for (unsigned int slot = h % kTableSize;; slot = (slot + 1) % kTableSize) {
      unsigned long long seen = static_cast<volatile unsigned long long*>(tables_.facets)[slot];
      if (seen == kNoFacet) {
        seen = atomicCAS(&tables_.facets[slot], kNoFacet, key);
        if (seen == kNoFacet) {
          if constexpr (kNodes == 0) static_cast<volatile int*>(tables_.thirds)[slot] = third;
          atomicAdd(&tables_.facet_counts[slot], 1U);
          atomicAdd(&tables_.facet_count, 1U);
          return;
        }
      }
      if (seen != key) continue;
      if constexpr (kNodes == 0) {
        int written = kUnset;  // whoever took the slot is about to write it
        while (written == kUnset) written = static_cast<volatile int*>(tables_.thirds)[slot];
        if (written != third) continue;
      }
      atomicAdd(&tables_.facet_counts[slot], 1U);
      return;
    }
  }

  const RowTask& task_;
  Tables& tables_;
  int node_;
  unsigned int parts_, part_;
};

/// Adds up what the blocks before have found, as soon as it is known: a
/// decoupled look-back. Called by one whole warp; returns the sum before
/// `block`. Source: Merrill, Garland 2016, "Single-pass parallel prefix scan with
/// decoupled look-back".
__device__ inline unsigned long long look_back(unsigned long long* words, unsigned int block,
                                               unsigned long long own) {
  constexpr unsigned long long kOwn = 1ULL << 62, kSum = 2ULL << 62, kValue = kOwn - 1;
  const unsigned int lane = threadIdx.x % kWarp;
  volatile unsigned long long* const word = words;
  if (lane == 0) word[block] = (block == 0 ? kSum : kOwn) | own;
  unsigned long long before = 0;
  for (std::int64_t last = static_cast<std::int64_t>(block) - 1; last >= 0; last -= kWarp) {
    const std::int64_t at = last - lane;
    unsigned long long found = kSum;
    if (at >= 0) {
      do {
        found = word[at];
      } while (found < kOwn);
    }
    __syncwarp();
    const unsigned int sums = __ballot_sync(0xffffffffU, found >= kSum);
    const unsigned int used = sums == 0 ? kWarp - 1 : static_cast<unsigned int>(__ffs(sums)) - 1;
    unsigned long long value = lane <= used ? found & kValue : 0;
    for (int step = kWarp / 2; step > 0; step /= 2) {
      value += __shfl_xor_sync(0xffffffffU, value, step);
    }
    before += value;
    if (sums != 0) break;
  }
  if (lane == 0 && block != 0) word[block] = kSum | (before + own);
  return before;
}

/// A warp a node: neighbours and facets of its ball go into hash tables in shared
/// memory; each facet is counted at its lowest node. Exact: keys are compared,
/// never their hashes. Rows are put one behind the other by a look-back over the
/// blocks, in one pass.
template <int kNodes>
__global__ void __launch_bounds__(kBlockSize) row_kernel(RowTask task) {
  using Search = RowSearch<kNodes>;
  __shared__ typename Search::Tables all_tables[kWarpsPerBlock];
  __shared__ int rows[kRowsPerBlock][kRowCapacity];
  __shared__ unsigned int degrees[kRowsPerBlock];
  __shared__ unsigned int cuts[kRowsPerBlock];  // parts of a row that does not fit, else 0
  __shared__ unsigned int block;
  __shared__ unsigned long long places[kRowsPerBlock];
  if (threadIdx.x == 0) block = atomicAdd(&task.state->next_block, 1U);
  __syncthreads();
  const unsigned int warp = threadIdx.x / kWarp, lane = threadIdx.x % kWarp;
  const std::size_t first = std::size_t{block} * kRowsPerBlock;
  typename Search::Tables& tables = all_tables[warp];
  const NodeId* const caller_of = task.caller_of;
  const auto node_key = [=](NodeId n) { return static_cast<unsigned int>(caller_of[n]); };
  const ElementId* const names = task.element_names;
  const auto element_key = [=](ElementId e) { return names == nullptr ? e : names[e]; };

  for (unsigned int r = warp; r < kRowsPerBlock; r += kWarpsPerBlock) {
    const std::size_t node = first + r;
    unsigned int degree = 0, parts = 1;
    if (node < task.node_count) {
      for (bool fits = false; !fits;) {
        fits = true;
        degree = 0;
        for (unsigned int part = 0; part < parts && fits; ++part) {
          Search search(task, tables, static_cast<int>(node), parts, part);
          fits = search.run([&](unsigned int place, int id) {
            if (place < kRowCapacity) rows[r][place] = id;
          });
          search.mark_boundary();
          degree += search.neighbour_count();
          __syncwarp();
        }
        if (!fits) parts *= 2;
      }
      if (parts == 1 && degree <= kRowCapacity) {
        parts = 0;
        rank_row_by_warp(rows[r], degree, tables.nodes, node_key);
      }
      if (task.sort_balls) {
        ElementId* const ball = task.ball_entries + task.ball_offsets[node];
        const auto size =
            static_cast<unsigned int>(task.ball_offsets[node + 1] - task.ball_offsets[node]);
        if (size <= kRowCapacity) {
          rank_row_by_warp(ball, size, tables.nodes, element_key);
        } else {
          sort_row_by_warp(ball, size, element_key);
        }
      }
    }
    if (lane == 0) {
      degrees[r] = degree;
      cuts[r] = parts;
    }
    __syncwarp();
  }
  __syncthreads();

  static_assert(kRowsPerBlock == kWarp);
  if (warp == 0) {
    unsigned int sum = degrees[lane];  // up to and with this row
    for (int step = 1; step < kWarp; step *= 2) {
      const unsigned int lower = __shfl_up_sync(0xffffffffU, sum, step);
      if (lane >= step) sum += lower;
    }
    const unsigned int total = __shfl_sync(0xffffffffU, sum, kWarp - 1);
    const unsigned long long before = look_back(task.look_back, block, total);
    const std::size_t node = first + lane;
    if (node < task.node_count) {
      task.offsets[node] = static_cast<std::int64_t>(before + sum - degrees[lane]);
    }
    if (node + 1 == task.node_count) {
      task.offsets[node + 1] = static_cast<std::int64_t>(before + sum);
      task.state->ring_entries = before + sum;
    }
    places[lane] = before + sum - degrees[lane];
  }
  __syncthreads();

  for (unsigned int r = warp; r < kRowsPerBlock && first + r < task.node_count;
       r += kWarpsPerBlock) {
    const unsigned int degree = degrees[r], parts = cuts[r];
    if (places[r] + degree > task.capacity) continue;  // the host will see and call again
    NodeId* const row = task.entries + places[r];
    if (parts == 0) {
      for (unsigned int n = lane; n < degree; n += kWarp) row[n] = rows[r][n];
      continue;
    }
    unsigned int found = 0;
    for (unsigned int part = 0; part < parts; ++part) {
      Search search(task, tables, static_cast<int>(first + r), parts, part);
      search.run([&](unsigned int place, int id) { row[found + place] = id; });
      found += search.neighbour_count();
      __syncwarp();
    }
    sort_row_by_warp(row, degree, node_key);
  }
}

}  // namespace meshsmooth::detail
