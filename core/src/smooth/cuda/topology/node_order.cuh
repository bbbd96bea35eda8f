#pragma once

#include <cub/block/block_radix_sort.cuh>
#include <cub/device/device_radix_sort.cuh>

#include <type_traits>

#include "smooth/base/space_curve.hpp"
#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/cuda/topology/prepare_state.hpp"

namespace meshsmooth::detail {

MESHSMOOTH_HD inline Box box_of(const PrepareState& state) {
  const auto [x, y, z] = state.lower;
  const auto [u, v, w] = state.upper;
  return {{from_ordered_bits(~x), from_ordered_bits(~y), from_ordered_bits(~z)},
          {from_ordered_bits(u), from_ordered_bits(v), from_ordered_bits(w)}};
}

/// Extends the state's box by all finite positions, and flags others. The threads of all blocks
/// share the work; a block has kThreads, and `shared` one value for each.
template <int kThreads, class Real>
__device__ void find_box(std::size_t count, const Vec3<Real>* positions, Vec3<Real>* shared,
                         PrepareState* state) {
  const Real infinity =
      std::is_same_v<Real, float> ? static_cast<Real>(HUGE_VALF) : static_cast<Real>(HUGE_VAL);
  Vec3<Real> low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  const auto lower = [](Real a, Real b) { return a < b ? a : b; };
  const auto higher = [](Real a, Real b) { return a > b ? a : b; };
  const std::size_t step = std::size_t{gridDim.x} * kThreads;
  for (std::size_t i = std::size_t{blockIdx.x} * kThreads + threadIdx.x; i < count; i += step) {
    const Vec3<Real> p = positions[i];
    if (!(isfinite(p.x) && isfinite(p.y) && isfinite(p.z))) {
      state->wrong_position = 1;
      continue;
    }
    low = {lower(low.x, p.x), lower(low.y, p.y), lower(low.z, p.z)};
    high = {higher(high.x, p.x), higher(high.y, p.y), higher(high.z, p.z)};
  }
  low = reduce_block<kThreads>(low, shared, [=](const Vec3<Real>& a, const Vec3<Real>& b) {
    return Vec3<Real>{lower(a.x, b.x), lower(a.y, b.y), lower(a.z, b.z)};
  });
  high = reduce_block<kThreads>(high, shared, [=](const Vec3<Real>& a, const Vec3<Real>& b) {
    return Vec3<Real>{higher(a.x, b.x), higher(a.y, b.y), higher(a.z, b.z)};
  });
  if (threadIdx.x != 0) return;
  atomicMax(&state->lower[0], ~ordered_bits(low.x));
  atomicMax(&state->lower[1], ~ordered_bits(low.y));
  atomicMax(&state->lower[2], ~ordered_bits(low.z));
  atomicMax(&state->upper[0], ordered_bits(high.x));
  atomicMax(&state->upper[1], ordered_bits(high.y));
  atomicMax(&state->upper[2], ordered_bits(high.z));
}

/// grid   up to two blocks of kBlockSize per multiprocessor
/// shared one position per thread
/// order  deterministic: minima and maxima
/// equals `find_box` of the CPU backend
template <class Real>
__global__ void __launch_bounds__(kBlockSize)
    box_kernel(std::size_t count, const Vec3<Real>* positions, PrepareState* state) {
  __shared__ Vec3<Real> shared[kBlockSize];
  find_box<kBlockSize>(count, positions, shared, state);
}

/// Bits per axis of the Hilbert curve: a few times as many cells as nodes.
[[nodiscard]] inline int curve_bits(std::size_t node_count) {
  int bits = 2;
  while (bits < 10 && (std::size_t{1} << (3 * bits)) < 4 * node_count) ++bits;
  return bits;
}

/// Input of the node order and the arrays that follow from it.
template <class Real>
struct NodeOrder {
  std::size_t node_count;
  const Vec3<Real>* given;  // by the caller's numbers
  NodeId* caller_ids;
  NodeId* internal_of;
  Vec3<Real>* positions;
  std::uint8_t* fixed;
  std::uint32_t* ball_sizes;  // one more than nodes

  __device__ void put(std::size_t node, NodeId caller) const {
    caller_ids[node] = caller;
    internal_of[caller] = static_cast<NodeId>(node);
    positions[node] = given[caller];
    fixed[node] = 0;
    ball_sizes[node] = 0;
    if (node == 0) ball_sizes[node_count] = 0;
  }
  /// Along the curve.
  [[nodiscard]] __device__ std::uint32_t key(std::size_t caller, const Box& box, int bits) const {
    const Vec3<Real> p = given[caller];
    const bool finite = isfinite(p.x) && isfinite(p.y) && isfinite(p.z);
    return finite ? static_cast<std::uint32_t>(hilbert_index(p, box, bits)) : 0;
  }
};

inline constexpr int kSmallOrderThreads = 1024, kSmallOrderItems = 8;
inline constexpr std::size_t kSmallOrder = std::size_t{kSmallOrderThreads} * kSmallOrderItems;

/// Box and order of a small mesh, whose cost is launches rather than work.
/// grid   one block of kSmallOrderThreads
/// shared CUB's radix sort, or one position per thread
/// order  deterministic: a stable sort
/// fast   one launch instead of seven: at 5k neighbours 0.174 to 0.119 ms (H200)
/// equals `box_kernel` and the sort of `order_nodes`
template <class Real>
__global__ void __launch_bounds__(kSmallOrderThreads)
    small_order_kernel(NodeOrder<Real> order, int bits, PrepareState* state) {
  using Sort =
      cub::BlockRadixSort<std::uint32_t, kSmallOrderThreads, kSmallOrderItems, std::uint32_t>;
  __shared__ union {
    typename Sort::TempStorage sort;
    Vec3<Real> positions[kSmallOrderThreads];
  } space;
  find_box<kSmallOrderThreads>(order.node_count, order.given, space.positions, state);
  __syncthreads();
  const Box box = box_of(*state);
  std::uint32_t keys[kSmallOrderItems], callers[kSmallOrderItems];
#pragma unroll
  for (int i = 0; i < kSmallOrderItems; ++i) {
    callers[i] = threadIdx.x * kSmallOrderItems + i;  // so that ties keep the caller's order
    // Padding sorts to the end.
    keys[i] = callers[i] < order.node_count ? order.key(callers[i], box, bits) : 1U << (3 * bits);
  }
  Sort(space.sort).SortBlockedToStriped(keys, callers, 0, 3 * bits + 1);
#pragma unroll
  for (int i = 0; i < kSmallOrderItems; ++i) {
    const std::size_t node = i * kSmallOrderThreads + threadIdx.x;
    if (node < order.node_count) order.put(node, static_cast<NodeId>(callers[i]));
  }
}

/// Bytes of `order_nodes`: keys and ids, as much again in the sort; internal ids and ball sizes.
[[nodiscard]] constexpr std::int64_t order_bytes(std::int64_t node_count) {
  return node_count * (12 + 8 + 8);
}

/// Internal numbers along the Hilbert curve, and the box. Only speed depends on the numbers, so the
/// sort uses 32-bit keys and as few of their bits as suffice.
template <class Real>
void order_nodes(CudaExecutor& executor, const NodeOrder<Real>& order, PrepareState* state) {
  const std::size_t node_count = order.node_count;
  const int bits = curve_bits(node_count);
  if (node_count <= kSmallOrder) {
    launch<&small_order_kernel<Real>>(executor.stream(), {1, kSmallOrderThreads}, order, bits,
                                      state);
    return;
  }
  launch<&box_kernel<Real>>(
      executor.stream(),
      {block_count(node_count,
                   2 * static_cast<std::size_t>(executor.lane().multiprocessor_count()))},
      node_count, order.given, state);
  auto keys = executor.allocate<std::uint32_t>(node_count);
  auto sorted_keys = executor.allocate<std::uint32_t>(node_count);
  auto ids = executor.allocate<NodeId>(node_count);
  std::uint32_t* const key = keys.data();
  NodeId* const id = ids.data();
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    key[node] = order.key(node, box_of(*state), bits);
    id[node] = static_cast<NodeId>(node);
  });
  executor.with_workspace([&](void* space, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(space, bytes, key, sorted_keys.data(), id,
                                           order.caller_ids, node_count, 0, 3 * bits,
                                           executor.stream());
  });
  executor.for_each(node_count,
                    [=] __device__(std::size_t node) { order.put(node, order.caller_ids[node]); });
}

}  // namespace meshsmooth::detail
