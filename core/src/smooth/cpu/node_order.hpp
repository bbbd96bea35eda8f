#pragma once

#include "smooth/base/space_curve.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cpu/cpu_executor.hpp"

namespace meshsmooth::detail {

template <class Real>
Box find_box(CpuExecutor& executor, const Vec3<Real>* positions, std::size_t node_count) {
  const Vec3d first = vec3_cast<double>(positions[0]);
  return executor.reduce(
      node_count, Box{first, first},
      [=](std::size_t node) {
        const Vec3d p = vec3_cast<double>(positions[node]);
        return Box{p, p};
      },
      [](const Box& a, const Box& b) {
        const auto low = [](double x, double y) { return x < y ? x : y; };
        const auto high = [](double x, double y) { return x > y ? x : y; };
        return Box{
            {low(a.lower.x, b.lower.x), low(a.lower.y, b.lower.y), low(a.lower.z, b.lower.z)},
            {high(a.upper.x, b.upper.x), high(a.upper.y, b.upper.y), high(a.upper.z, b.upper.z)}};
      });
}

/// Node numbers inside a job: nodes that are close in space are close in memory. Only speed
/// depends on it, because rows keep the caller's order.
struct Renumbering {
  CpuBuffer<NodeId> caller_ids;   // internal -> caller
  CpuBuffer<NodeId> internal_of;  // caller -> internal
};

/// cost   O(n log n), 16 B a node, of which 8 stay
/// order  deterministic: ties by the caller's node id
template <class Real>
Renumbering renumber_nodes(CpuExecutor& executor, const Vec3<Real>* positions,
                           std::size_t node_count, const Box& box) {
  Renumbering result;
  auto keys = executor.allocate<std::uint64_t>(node_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(node_count, [=](std::size_t node) {
    constexpr int kBits = 11;
    key[node] = (hilbert_index(positions[node], box, kBits) << 31) | node;  // 33 + 31 bits
  });
  executor.sort(key, node_count);

  result.caller_ids = executor.allocate<NodeId>(node_count);
  result.internal_of = executor.allocate<NodeId>(node_count);
  NodeId* const caller_ids = result.caller_ids.data();
  NodeId* const internal_of = result.internal_of.data();
  executor.for_each(node_count, [=](std::size_t node) {
    const auto caller = static_cast<NodeId>(key[node] & 0x7fffffffU);
    caller_ids[node] = caller;
    internal_of[caller] = static_cast<NodeId>(node);
  });
  return result;
}

/// `renumber_nodes` by the topology alone: breadth first along the rings, from the caller's first
/// node of each component. All meshes with one topology share the result, and their jobs have the
/// same bits whichever came first.
///
/// takes  rings by the caller's ids
/// cost   O(nodes + ring entries), serial
inline Renumbering renumber_by_rings(CpuExecutor& executor, std::size_t node_count,
                                     const Rows<NodeId>& rings) {
  constexpr std::size_t kNodesPerCheck = 65536;
  Renumbering result;
  result.caller_ids = executor.allocate<NodeId>(node_count);
  result.internal_of = executor.allocate<NodeId>(node_count);
  NodeId* const queue = result.caller_ids.data();
  NodeId* const number = result.internal_of.data();
  executor.for_each(node_count, [=](std::size_t node) { number[node] = -1; });
  std::size_t end = 0;
  const auto visit = [&](NodeId node) {
    if (number[node] >= 0) return;
    number[node] = static_cast<NodeId>(end);
    queue[end++] = node;
  };
  std::size_t next = 0;
  for (std::size_t first = 0; first < node_count; ++first) {
    visit(static_cast<NodeId>(first));
    for (; next < end; ++next) {
      if (next % kNodesPerCheck == 0) executor.check();
      const auto node = static_cast<std::size_t>(queue[next]);
      for (const NodeId* n = rings.begin(node); n != rings.end(node); ++n) visit(*n);
    }
  }
  return result;
}

}  // namespace meshsmooth::detail
