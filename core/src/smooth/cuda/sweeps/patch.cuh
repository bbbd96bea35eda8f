#pragma once

#include "smooth/cuda/sweeps/patch_sizes.hpp"
#include "smooth/cuda/sweeps/sell_rings.cuh"

namespace meshsmooth::detail {

/// A free node of a patch.
struct FreeNode {
  std::uint32_t word;

  static constexpr std::uint32_t kShared = 1U << 31;
  /// Its index in the patch, and whether other patches read it.
  [[nodiscard]] __device__ int own() const { return static_cast<int>(word & 0xffffU); }
  [[nodiscard]] __device__ bool shared() const { return (word & kShared) != 0; }
};

/// A block's share of the mesh in its shared memory: consecutive nodes, which lie together along
/// the curve, the rings of the free ones in SELL-32 with 16-bit indices, and the halo. Free nodes
/// are sorted by the lengths of their rings, which leaves little padding (SELL-C-sigma).
class Patch {
 public:
  __device__ Patch(const PatchSizes& sizes, unsigned char* memory, const Surroundings& around)
      : sizes_(sizes), around_(around), first_(static_cast<int>(blockIdx.x) * sizes.nodes) {
    const auto take = [&]<class T>(T*& to, int count) {
      to = reinterpret_cast<T*>(memory);
      memory += static_cast<std::size_t>(count) * sizeof(T);
    };
    take(positions_, PatchSizes::kBuffers * sizes.positions());
    take(squared_moves_, 2 * sizes.nodes);
    take(entries_, sizes.entries / 4);
    take(slices_, sizes.slices());
    take(halo_nodes_, sizes.halo);
    take(ring_sizes_, sizes.nodes);
    take(free_nodes_, sizes.nodes);
  }

  /// Before a sweep, triple-buffered: own nodes, halo, a position of 0.
  [[nodiscard]] __device__ float4* positions(int sweep) const {
    return positions_ + sweep % PatchSizes::kBuffers * sizes_.positions();
  }
  [[nodiscard]] __device__ bool has(int own) const {
    return static_cast<std::size_t>(first_) + own < around_.node_count;
  }
  [[nodiscard]] __device__ std::size_t node(int own) const {
    return static_cast<std::size_t>(first_) + own;
  }
  /// Of the own nodes in a sweep, squared; below 0: at rest.
  [[nodiscard]] __device__ double* squared_moves(int sweep) const {
    return squared_moves_ + sweep % 2 * sizes_.nodes;
  }
  /// Nodes of the halo; -1: fixed. Their positions follow those of the own nodes.
  [[nodiscard]] __device__ int halo_count() const { return halo_count_; }
  [[nodiscard]] __device__ int halo_node(int index) const { return halo_nodes_[index]; }
  [[nodiscard]] __device__ int free_count() const { return free_count_; }
  [[nodiscard]] __device__ FreeNode free_node(int index) const { return free_nodes_[index]; }

  /// `UniformMean` of a free node. A second text because rings and positions are in shared memory;
  /// same order of additions, and parity_test compares the bits with the CPU's.
  [[nodiscard]] __device__ Vec3<float> mean(int index, const float4* from) const {
    const int2 slice = slices_[index / kWarp];
    const Vec3<float> sum = sum_of_slice<float>(entries_ + (slice.x * kWarp + index % kWarp),
                                                slice.y, [&](std::uint16_t at) {
                                                  const float4 p = from[at];
                                                  return Vec3<float>{p.x, p.y, p.z};
                                                });
    const auto count = static_cast<float>(ring_sizes_[free_nodes_[index].own()]);
    return mean_of_sum(sum, count);
  }

  /// Builds the patch; all threads call. False if something does not fit.
  __device__ bool load(const Vec3<float>* positions) {
    __shared__ Scratch scratch;
    // The memory of the positions is a set of nodes first, a bit each, and its prefix sums.
    word_count_ = static_cast<int>((around_.node_count + 31) / 32);
    halo_bits_ = reinterpret_cast<unsigned int*>(positions_);
    halo_before_ = reinterpret_cast<int*>(halo_bits_ + word_count_);
    if (thread() == 0) scratch.row_count = 0;
    if (thread() < kBins) scratch.first_of[thread()] = 0;
    for (int w = thread(); w < word_count_; w += threads()) halo_bits_[w] = 0;
    __syncthreads();
    find_halo(scratch);
    if (!order_free_nodes(scratch) || !make_slices(scratch)) return false;
    fill_slices();
    load_positions(positions);
    return true;
  }

 private:
  static constexpr int kMostRows = 15;  // lengths that are distinguished, in rows of four
  static constexpr int kBins = kMostRows + 2;
  struct Scratch {
    int row_count;
    int first_of[kBins];  // free node by its rows, the longest first
    int warp_totals[kWarp];
  };

  static __device__ int thread() { return static_cast<int>(threadIdx.x); }
  static __device__ int threads() { return static_cast<int>(blockDim.x); }
  static __device__ int rounded_up(int count) { return (count + kWarp - 1) / kWarp * kWarp; }
  static __device__ int bin_of(int ring_size) {
    return kMostRows + 1 - min((ring_size + 3) / 4, kMostRows);
  }

  /// Four entries of a ring; past its end the last one.
  static __device__ FourOf<NodeId> four_of(const NodeId* ring, int first, int size) {
    FourOf<NodeId> four{};
    if (first >= size) return four;
#pragma unroll
    for (int k = 0; k < 4; ++k) four.values[k] = ring[min(first + k, size - 1)];
    return four;
  }
  [[nodiscard]] __device__ bool is_own(NodeId node) const {
    return node >= first_ && node < first_ + sizes_.nodes;
  }
  [[nodiscard]] __device__ const NodeId* ring(int own) const {
    return around_.rings.begin(has(own) ? node(own) : 0);
  }
  /// The index of an own node or, after `order_free_nodes`, of one in the halo.
  [[nodiscard]] __device__ int index_of(NodeId other) const {
    if (is_own(other)) return other - first_;
    const unsigned int below = (1U << (other % 32)) - 1;
    return sizes_.nodes + halo_before_[other / 32] + __popc(halo_bits_[other / 32] & below);
  }

  /// Sizes of the rings, how many are of a length, and the set of nodes in the halo.
  __device__ __forceinline__ void find_halo(Scratch& scratch) {
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      const bool moves = has(own) && around_.fixed[node(own)] == 0;
      const int size = moves ? static_cast<int>(around_.rings.size(node(own))) : 0;
      ring_sizes_[own] = size;
      aggregated_increment(kAllLanes, scratch.first_of, bin_of(size), size > 0);
      const NodeId* const nodes = ring(own);
      for (int first = 0; first < size; first += 4) {
        const FourOf<NodeId> four = four_of(nodes, first, size);
#pragma unroll
        for (int k = 0; k < 4; ++k) {
          const NodeId other = four.values[k];
          if (!is_own(other)) atomicOr(&halo_bits_[other / 32], 1U << (other % 32));
        }
      }
    }
    __syncthreads();
  }

  /// Numbers the halo and sorts the free nodes by their rings' lengths. False: no room for the
  /// halo.
  __device__ __forceinline__ bool order_free_nodes(Scratch& scratch) {
    if (thread() == 0) {
      int sum = 0;
      for (int bin = 0; bin < kBins; ++bin) {
        const int count = scratch.first_of[bin];
        scratch.first_of[bin] = sum;
        sum += count;
      }
    }
    number_halo(scratch);
    free_count_ = scratch.first_of[kMostRows + 1];
    __syncthreads();
    if (halo_count_ > sizes_.halo) return false;
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      const int size = ring_sizes_[own];
      const int at = aggregated_increment(kAllLanes, scratch.first_of, bin_of(size), size > 0);
      if (size > 0) free_nodes_[at] = {static_cast<std::uint32_t>(own)};
    }
    __syncthreads();
    return true;
  }
  /// Lists the halo in ascending order; halo_before_[w] becomes the count before word w.
  __device__ __forceinline__ void number_halo(Scratch& scratch) {
    const int each = (word_count_ + threads() - 1) / threads();
    const int begin = min(thread() * each, word_count_), end = min(begin + each, word_count_);
    int own = 0;
    for (int w = begin; w < end; ++w) own += __popc(halo_bits_[w]);
    const BlockPrefix<int> prefix = scan_block(own, threads() / kWarp, scratch.warp_totals);
    int index = prefix.before_warp + prefix.in_warp;
    for (int w = begin; w < end; ++w) {
      halo_before_[w] = index;
      for (unsigned int left = halo_bits_[w]; left != 0; left &= left - 1, ++index) {
        if (index < sizes_.halo) halo_nodes_[index] = 32 * w + __ffs(static_cast<int>(left)) - 1;
      }
    }
    halo_count_ = prefix.total;
  }

  /// Allots rows to the slices. False if they do not fit.
  __device__ __forceinline__ bool make_slices(Scratch& scratch) {
    for (int at = thread(); at < rounded_up(free_count_); at += threads()) {
      const int longest = max_of_warp(at < free_count_ ? ring_sizes_[free_nodes_[at].own()] : 0);
      if (at % kWarp != 0) continue;
      const int rows = (longest + 3) / 4;
      slices_[at / kWarp] = {atomicAdd(&scratch.row_count, rows), rows};
    }
    __syncthreads();
    return scratch.row_count * kWarp <= sizes_.entries / 4;
  }
  __device__ __forceinline__ void fill_slices() {
    for (int at = thread(); at < rounded_up(free_count_); at += threads()) {
      const int2 slice = slices_[at / kWarp];
      const int own = at < free_count_ ? free_nodes_[at].own() : 0;
      const int size = at < free_count_ ? ring_sizes_[own] : 0;
      const NodeId* const nodes = ring(own);
      bool shared = false;
      for (int row = 0; row < slice.y; ++row) {
        FourOf<std::uint16_t> four;
        const FourOf<NodeId> others = four_of(nodes, 4 * row, size);
#pragma unroll
        for (int k = 0; k < 4; ++k) {
          int index = sizes_.positions() - 1;
          if (4 * row + k < size) {
            index = index_of(others.values[k]);
            shared |= index >= sizes_.nodes;
          }
          four.values[k] = static_cast<std::uint16_t>(index);
        }
        entries_[(slice.x + row) * kWarp + at % kWarp] = four;
      }
      if (shared) free_nodes_[at].word |= FreeNode::kShared;
    }
    __syncthreads();
  }

  __device__ __forceinline__ void load_positions(const Vec3<float>* positions) {
    for (int own = thread(); own < sizes_.nodes; own += threads()) {
      if (has(own)) put(own, positions[node(own)]);
    }
    for (int h = thread(); h < halo_count_; h += threads()) {
      const auto other = static_cast<std::size_t>(halo_nodes_[h]);
      put(sizes_.nodes + h, positions[other]);
      if (around_.fixed[other] != 0) halo_nodes_[h] = -1;
    }
    if (thread() == 0) put(sizes_.positions() - 1, {0, 0, 0});
    __syncthreads();
  }
  /// Into all buffers: fixed nodes are never written again.
  __device__ void put(int index, Vec3<float> position) const {
    for (int buffer = 0; buffer < PatchSizes::kBuffers; ++buffer) {
      positions(buffer)[index] = {position.x, position.y, position.z, 0};
    }
  }

  PatchSizes sizes_;
  const Surroundings& around_;
  int first_;
  int word_count_ = 0, halo_count_ = 0, free_count_ = 0;
  unsigned int* halo_bits_ = nullptr;
  int* halo_before_ = nullptr;
  float4* positions_;
  double* squared_moves_;
  FourOf<std::uint16_t>* entries_;
  int* halo_nodes_;
  int2* slices_;  // first row, rows
  int* ring_sizes_;
  FreeNode* free_nodes_;
};

}  // namespace meshsmooth::detail
