#pragma once

#include <optional>

#include "smooth/averaging/means.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/cuda/primitives/vector_access.cuh"

namespace meshsmooth::detail {

/// Streaming load: data read once a sweep must not evict positions from the caches.
__device__ inline FourOf<NodeId> read_ids(const FourOf<NodeId>* from) {
  const int4 four = __ldcs(reinterpret_cast<const int4*>(from));
  return {four.x, four.y, four.z, four.w};
}
__device__ inline FourOf<std::uint16_t> read_ids(const FourOf<std::uint16_t>* shared) {
  return *shared;
}

/// The sum of the positions of a thread's ring, in the ring's order, from SELL-32 (sliced ELLPACK):
/// the rings of 32 consecutive nodes are interleaved, four entries each, so that a warp with a node
/// per thread reads whole lines. Shorter rings are padded with an entry whose position is +0, which
/// changes no sum.
///
/// `own` is the thread's first four entries; `fetch(id)` returns a position. Not unrolled: the
/// compiler then made loads wait for each other's registers (10M 305 to 630 us by how it unrolled,
/// H200).
template <class Real, class Id, class Fetch>
__device__ Vec3<Real> sum_of_slice(const FourOf<Id>* own, int rows, const Fetch& fetch) {
  Vec3<Real> sum{0, 0, 0};
  FourOf<Id> ahead{};
  if (rows > 0) ahead = read_ids(own);
#pragma unroll 1
  for (int row = 0; row < rows; ++row) {
    const FourOf<Id> ids = ahead;
    if (row + 1 < rows) ahead = read_ids(own + (row + 1) * kWarp);
    Vec3<Real> positions[4];
#pragma unroll
    for (int k = 0; k < 4; ++k) positions[k] = fetch(ids.values[k]);
#pragma unroll
    for (int k = 0; k < 4; ++k) sum += positions[k];
  }
  return sum;
}

/// The rings of the free nodes in SELL-32.
struct SellRings {
  struct Slice {
    std::uint32_t first_row;  // a row: 32 times four entries
    std::uint32_t row_count;
  };
  DeviceBuffer<Slice> slices;
  DeviceBuffer<FourOf<NodeId>> entries;  // padded with node_count
  DeviceBuffer<int> sizes;               // of a node's ring, or kFixed
  static constexpr int kFixed = -1;
  /// Most entries, padding included, per entry of the rings.
  static constexpr std::int64_t kMostPadding = 2;

  static constexpr std::int64_t bytes(const MeshCounts& mesh) {
    return mesh.nodes * 4 + mesh.nodes / 4 + kMostPadding * mesh.edges * 2 * 4;
  }

  /// Nothing if consecutive rings differ so much that padding would take too much memory.
  static std::optional<SellRings> of(CudaExecutor& executor, const Surroundings& around) {
    const std::size_t node_count = around.node_count;
    const std::size_t slice_count = (node_count + kWarp - 1) / kWarp;
    SellRings result;
    result.slices = executor.allocate<Slice>(slice_count);
    result.sizes = executor.allocate<int>(node_count);
    auto total = executor.allocate<std::uint32_t>(1);
    executor.clear(total.data(), 1);
    Slice* const slices = result.slices.data();
    int* const sizes = result.sizes.data();
    std::uint32_t* const row_count = total.data();
    executor.for_each(slice_count * kWarp, [=] __device__(std::size_t node) {
      int size = kFixed;
      if (node < node_count) {
        if (around.fixed[node] == 0) size = static_cast<int>(around.rings.size(node));
        sizes[node] = size;
      }
      size = max_of_warp(size);
      if (node % kWarp != 0) return;
      const auto rows = static_cast<std::uint32_t>((max(size, 0) + 3) / 4);
      slices[node / kWarp] = {atomicAdd(row_count, rows), rows};
    });
    std::int64_t ring_entries = 0;
    std::uint32_t rows = 0;
    executor.download_later(around.rings.offsets + node_count, &ring_entries);
    executor.download(row_count, 1, &rows);
    const std::int64_t four_count = std::int64_t{rows} * kWarp;
    if (4 * four_count > kMostPadding * ring_entries) return std::nullopt;

    result.entries = executor.allocate<FourOf<NodeId>>(static_cast<std::size_t>(four_count));
    FourOf<NodeId>* const entries = result.entries.data();
    executor.for_each(slice_count * kWarp, [=] __device__(std::size_t node) {
      const Slice slice = slices[node / kWarp];
      const int size = node < node_count ? sizes[node] : 0;
      const NodeId* const ring = around.rings.begin(node < node_count ? node : 0);
      FourOf<NodeId>* const own = entries + (std::size_t{slice.first_row} * kWarp + node % kWarp);
      for (int row = 0; row < static_cast<int>(slice.row_count); ++row) {
        FourOf<NodeId> four;
#pragma unroll
        for (int k = 0; k < 4; ++k) {
          four.values[k] = 4 * row + k < size ? ring[4 * row + k] : static_cast<NodeId>(node_count);
        }
        own[row * kWarp] = four;
      }
    });
    return result;
  }
};

/// `UniformMean` on SELL-32: a second text because the layout decides the speed (10M 400 to 286 us
/// a sweep, H200). Same order of additions; parity_test compares the bits with the CPU's.
struct SellMean {
  const SellRings::Slice* slices;
  const FourOf<NodeId>* entries;
  const int* sizes;

  explicit SellMean(const SellRings& rings)
      : slices(rings.slices.data()), entries(rings.entries.data()), sizes(rings.sizes.data()) {}

  struct Ring {
    SellRings::Slice slice;
    int size;  // at most 0: nothing moves
  };
  /// What must be known before the entries can be fetched.
  [[nodiscard]] __device__ Ring ring(std::size_t node, std::size_t node_count) const {
    if (node >= node_count) return {{0, 0}, 0};
    return {slices[node / kWarp], sizes[node]};
  }

  /// x has a position of +0 at node_count.
  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Ring& ring, const P& x,
                                               std::size_t node) const {
    using Real = typename P::Real;
    const Vec3<Real> sum =
        sum_of_slice<Real>(entries + (std::size_t{ring.slice.first_row} * kWarp + node % kWarp),
                           static_cast<int>(ring.slice.row_count),
                           [&](NodeId other) { return x[static_cast<std::size_t>(other)]; });
    const auto count = static_cast<Real>(ring.size);
    return mean_of_sum(sum, count);
  }
};

}  // namespace meshsmooth::detail
