#pragma once

#include "smooth/cuda/topology/ring_task.cuh"
#include "smooth/cuda/topology/shared_rows.cuh"

namespace meshsmooth::detail {

inline constexpr int kTooLong = -1;  // in place of a degree

/// How often each facet at a node occurs, as a bit matrix over the row indices of the facet's two
/// other nodes: below the diagonal the parity of the number, above it whether it is nonzero.
/// Together with the number of all occurrences this distinguishes 0, 1, 2 and more.
class FacetUses {
 public:
  __device__ explicit FacetUses(RowEntries& bits) : bits_(bits) {
    for (int k = 0; k < kRowCapacity; ++k) bits_[k][threadIdx.x] = 0;
  }
  /// Fire-and-forget atomics: the words are private, but without a used return value the thread
  /// does not stall on the load (with two elements per pass: rings at 100k 105 to 91 us, H200).
  __device__ void add(unsigned int a, unsigned int b) {
    const unsigned int low = min(a, b), high = max(a, b);
    atomicXor(&bits_[high][threadIdx.x], 1 << low);
    atomicOr(&bits_[low][threadIdx.x], 1 << high);
  }
  /// Facets that occur an odd number of times, and all that occur.
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

inline constexpr int kElementsPerPass = 2;  // over the row, which is read once for all their nodes

/// Software-pipelined reading of a ball: the two dependent loads for the next elements are in
/// flight while the current ones are searched. Past the end the last element is re-read, which
/// avoids a bounds check.
template <int kNodes>
class BallPipeline {
 public:
  __device__ BallPipeline(const NodeId* connectivity, const BallRow& ball)
      : connectivity_(connectivity), ball_(ball) {
    if (ball.size() == 0) return;
    find(0);
    load();
    find(kElementsPerPass);
  }
  /// Node n of the current pass's element h.
  [[nodiscard]] __device__ int node(int h, int n) const { return nodes_[h][n]; }
  /// Moves on from the pass that begins at `element`.
  __device__ void advance(std::uint32_t element) {
    load();
    find(element + 2 * kElementsPerPass);
  }

 private:
  __device__ void find(std::uint32_t element) {
#pragma unroll
    for (int h = 0; h < kElementsPerPass; ++h) next_[h] = ball_[min(element + h, ball_.size() - 1)];
  }
  __device__ void load() {
#pragma unroll
    for (int h = 0; h < kElementsPerPass; ++h) {
      load_group(connectivity_ + std::size_t{next_[h]} * kNodes, nodes_[h]);
    }
  }

  const NodeId* connectivity_;
  const BallRow& ball_;
  int nodes_[kElementsPerPass][kNodes];
  ElementId next_[kElementsPerPass];
};

/// Lowers found[h][n], ~0 before, to the index of queries[h][n] if the thread's row has it.
template <int kOthers>
__device__ __forceinline__ void search_row(const RowEntries& row, int row_end,
                                           const unsigned int (&queries)[kElementsPerPass][kOthers],
                                           unsigned int (&found)[kElementsPerPass][kOthers]) {
  // As far as the longest row of the warp: unused entries match no id.
#if __CUDA_ARCH__ >= 800
  const int longest = min(__reduce_max_sync(__activemask(), row_end), kRowCapacity);
#else
  constexpr int longest = kRowCapacity;
#endif
#pragma unroll 1
  for (int k = 0; k < longest; k += 8) {
#pragma unroll
    for (int j = 0; j < 8; ++j) {
      const auto entry = static_cast<unsigned int>(row[k + j][threadIdx.x]);
#pragma unroll
      for (int h = 0; h < kElementsPerPass; ++h) {
#pragma unroll
        for (int n = 0; n < kOthers; ++n) {
          found[h][n] = __viaddmin_u32(entry, 0U - queries[h][n], found[h][n]);
        }
      }
    }
  }
}

/// Ring and boundary mark of the node, by its own thread. The row is left unsorted in `row`; `bits`
/// is scratch memory. Returns the degree, or kTooLong.
///
/// A facet at the node is a pair of its neighbours (in a surface one neighbour, here paired with
/// the node itself in row index 0). Each row entry packs (id << kIndexBits | index). Subtracting
/// the packed query yields the index on a match and a larger value otherwise, so that an unsigned
/// running minimum is a branch-free search.
template <int kNodes>
__device__ int find_simplex_row(const RingTask& task, int node, RowEntries& row, RowEntries& bits) {
  const unsigned int t = threadIdx.x;
  constexpr int kOthers = kNodes - 1;
  constexpr int kFirst = kNodes == 3 ? 1 : 0;  // index of the first neighbour
  constexpr int kPass = kElementsPerPass;
  FacetUses uses(bits);
  for (int k = 0; k < kRowCapacity; ++k) row[k][t] = -1;
  int row_end = kFirst;
  const BallRow ball(task, static_cast<std::size_t>(node));
  BallPipeline<kNodes> ahead(task.elements.runs[0].nodes, ball);
  for (std::uint32_t e = 0; e < ball.size(); e += kPass) {
    unsigned int queries[kPass][kOthers], found[kPass][kOthers];
#pragma unroll
    for (int h = 0; h < kPass; ++h) {
#pragma unroll
      for (int n = 0; n < kOthers; ++n) {
        const int id = ahead.node(h, n) == node ? ahead.node(h, kOthers) : ahead.node(h, n);
        queries[h][n] = static_cast<unsigned int>(id) << kIndexBits;
        found[h][n] = ~0U;
      }
    }
    ahead.advance(e);
    search_row(row, row_end, queries, found);
#pragma unroll
    for (int h = 0; h < kPass; ++h) {
#pragma unroll
      for (int n = 0; n < kOthers; ++n) {
        unsigned int& index = found[h][n];
#pragma unroll
        for (int m = 0; m < h * kOthers; ++m) {  // nodes of the same pass
          if (queries[m / kOthers][m % kOthers] == queries[h][n]) {
            index = found[m / kOthers][m % kOthers];
          }
        }
        const bool is_new = index >= kRowCapacity;
        if (is_new) index = static_cast<unsigned int>(min(row_end, kRowCapacity - 1));
        if (is_new) row[index][t] = static_cast<int>(queries[h][n] | index);
        row_end += is_new ? 1 : 0;
      }
      if (e + h >= ball.size()) continue;
      if constexpr (kNodes == 3) {
        uses.add(0, found[h][0]);
        uses.add(0, found[h][1]);
      } else {
        uses.add(found[h][0], found[h][1]);
        uses.add(found[h][0], found[h][2]);
        uses.add(found[h][1], found[h][2]);
      }
    }
  }
  if (row_end > kRowCapacity) return kTooLong;
  const FacetUses::Counts counts = uses.count(row_end);
  const std::uint32_t all_uses = ball.size() * (kNodes == 3 ? 2 : 3);
  if (counts.odd != 0) task.fix.fixed[node] = kOnBoundary;
  if (all_uses != static_cast<std::uint32_t>(2 * counts.used - counts.odd)) {
    task.state->overused_facet = 1;
    task.fix.fixed[node] = kOnNonManifoldEdge;
  }
  const int degree = row_end - kFirst;
  for (int k = 0; k < degree; ++k) {
    row[k][t] = static_cast<int>(static_cast<unsigned int>(row[k + kFirst][t]) >> kIndexBits);
  }
  return degree;
}

}  // namespace meshsmooth::detail
