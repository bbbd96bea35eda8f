#pragma once

#include "meshsmooth/mesh.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// The box of all nodes.
struct Box {
  Vec3d lower, upper;
  [[nodiscard]] MESHSMOOTH_HD double diagonal() const { return norm(upper - lower); }
};

template <Executor E, class Real>
Box find_box(E& executor, const Vec3<Real>* positions, std::size_t node_count) {
  const Vec3d first = vec3_cast<double>(positions[0]);
  return executor.reduce(
      node_count, Box{first, first},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const Vec3d p = vec3_cast<double>(positions[node]);
        return Box{p, p};
      },
      [] MESHSMOOTH_HD(const Box& a, const Box& b) {
        const auto low = [](double x, double y) { return x < y ? x : y; };
        const auto high = [](double x, double y) { return x > y ? x : y; };
        return Box{
            {low(a.lower.x, b.lower.x), low(a.lower.y, b.lower.y), low(a.lower.z, b.lower.z)},
            {high(a.upper.x, b.upper.x), high(a.upper.y, b.upper.y), high(a.upper.z, b.upper.z)}};
      });
}

/// Place of a cell along Hilbert's curve through a grid of 2^bits cells a side.
/// Source: Skilling 2004, "Programming the Hilbert curve", AIP Conf. Proc. 707.
MESHSMOOTH_HD inline std::uint64_t hilbert_key(std::uint32_t x, std::uint32_t y, std::uint32_t z,
                                               int bits) {
  std::uint32_t axis[3] = {x, y, z};
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1) {
    const std::uint32_t low = q - 1;
    for (std::uint32_t& a : axis) {
      if ((a & q) != 0) {
        axis[0] ^= low;
      } else {
        const std::uint32_t swapped = (axis[0] ^ a) & low;
        axis[0] ^= swapped;
        a ^= swapped;
      }
    }
  }
  axis[1] ^= axis[0];
  axis[2] ^= axis[1];
  std::uint32_t flip = 0;
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1) {
    if ((axis[2] & q) != 0) flip ^= q - 1;
  }
  std::uint64_t key = 0;
  for (int bit = bits - 1; bit >= 0; --bit) {
    for (const std::uint32_t a : axis) key = (key << 1) | (((a ^ flip) >> bit) & 1U);
  }
  return key;
}

/// `hilbert_key` of a position in its box.
template <class Real>
MESHSMOOTH_HD std::uint64_t hilbert_place(Vec3<Real> position, const Box& box, int bits) {
  const Vec3d extent = box.upper - box.lower;
  double longest = extent.x > extent.y ? extent.x : extent.y;
  if (extent.z > longest) longest = extent.z;
  const double scale = longest > 0 ? static_cast<double>((1U << bits) - 1) / longest : 0.0;
  const Vec3d p = scale * (vec3_cast<double>(position) - box.lower);
  return hilbert_key(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                     static_cast<std::uint32_t>(p.z), bits);
}

/// Node numbers inside a job, along a space-filling curve, so that nodes that
/// are close in space are close in memory. Only speed depends on it: rows are
/// kept in the caller's order, so results do not.
template <Executor E>
struct Renumbering {
  typename E::template Buffer<NodeId> caller_ids;   // internal -> caller
  typename E::template Buffer<NodeId> internal_of;  // caller -> internal
};

/// cost   O(n log n), 16 B a node, of which 8 stay
/// order  deterministic: ties by the caller's node id
template <Executor E, class Real>
Renumbering<E> renumber_nodes(E& executor, const Vec3<Real>* positions, std::size_t node_count,
                              const Box& box) {
  Renumbering<E> result;
  auto keys = executor.template allocate<std::uint64_t>(node_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    constexpr int kBits = 11;
    key[node] = (hilbert_place(positions[node], box, kBits) << 31) | node;  // 33 + 31 bits
  });
  executor.sort(key, node_count);

  result.caller_ids = executor.template allocate<NodeId>(node_count);
  result.internal_of = executor.template allocate<NodeId>(node_count);
  NodeId* const caller_ids = result.caller_ids.data();
  NodeId* const internal_of = result.internal_of.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const auto caller = static_cast<NodeId>(key[node] & 0x7fffffffU);
    caller_ids[node] = caller;
    internal_of[caller] = static_cast<NodeId>(node);
  });
  return result;
}

}  // namespace meshsmooth::detail
