#pragma once

#include "smooth/cuda/topology/ring_task.cuh"

namespace meshsmooth::detail {

inline constexpr unsigned long long kNoFacet = ~0ULL;

__device__ inline unsigned int mixed(unsigned int h) {
  h *= 0x9e3779b1U;
  h = (h ^ (h >> 15)) * 0x85ebca6bU;
  return h ^ (h >> 13);
}

/// Open-addressing hash sets in shared memory.
template <unsigned int kSlots>
struct RingTables {
  int nodes[kSlots];
  unsigned long long facets[kSlots];  // two more nodes of a facet at the node
  unsigned int facet_counts[kSlots];
  int thirds[kSlots];  // the fourth node of a facet, or -1
  unsigned int node_count, facet_count;
};

/// Finds the ring of a node of any mesh by hashing: one warp or a whole block per node. The keys
/// are partitioned by hash into `parts` passes, so that those of a pass fit the tables however many
/// there are.
/// kNodes: of the only element type, a simplex; else 0.
template <int kNodes, unsigned int kThreads, unsigned int kSlots>
class HashedRing {
 public:
  using Tables = RingTables<kSlots>;

  /// A barrier of the threads that search together.
  static __device__ void sync() {
    if constexpr (kThreads == kWarp) {
      __syncwarp();
    } else {
      __syncthreads();
    }
  }

  __device__ HashedRing(const RingTask& task, Tables& tables, int node, unsigned int parts,
                        unsigned int part)
      : task_(task), tables_(tables), node_(node), parts_(parts), part_(part) {}

  /// Fills the tables from the node's ball; calls `emit(index, neighbour)` once per neighbour,
  /// index counting from 0. False: more keys than fit.
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

  /// Marks the node if one of its facets occurs once, or more than twice.
  __device__ void mark_boundary() const {
    std::uint8_t& mark = task_.fix.fixed[node_];
    bool overused = false;
    for (unsigned int slot = threadIdx.x % kThreads; slot < kSlots; slot += kThreads) {
      const unsigned int count = tables_.facet_counts[slot];
      overused |= count > 2;
      // An earlier pass may have found the mark that hides this one.
      if (count == 1 && mark != kOnNonManifoldEdge) mark = kOnBoundary;
    }
    sync();
    if (!overused) return;
    task_.state->overused_facet = 1;
    mark = kOnNonManifoldEdge;
  }

  [[nodiscard]] __device__ unsigned int neighbour_count() const { return tables_.node_count; }

 private:
  static constexpr int kUnset = -2;

  /// The load limit leaves room for one more key of each thread.
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
      int others[3] = {-1, -1, -1};  // ascending, then -1
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
      int written = kUnset;  // the thread that took the slot is about to write it
      while (written == kUnset) written = atomicOr(&tables_.thirds[slot], 0);
      if (written != third) continue;
      atomicAdd(&tables_.facet_counts[slot], 1U);
      return;
    }
  }

  const RingTask& task_;
  Tables& tables_;
  int node_;
  unsigned int parts_, part_;
};

}  // namespace meshsmooth::detail
