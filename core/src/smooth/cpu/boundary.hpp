#pragma once

#include <algorithm>
#include <atomic>

#include "smooth/base/fixed_nodes.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/cpu/row_counter.hpp"

namespace meshsmooth::detail {

/// The other nodes of a facet whose lowest node is known, ascending.
struct FacetRest {
  std::uint64_t first_two;
  NodeId third;  // -1: the facet has no more

  friend bool operator==(const FacetRest&, const FacetRest&) = default;
};

inline std::uint64_t ordered_pair(NodeId a, NodeId b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) |
         static_cast<std::uint64_t>(std::max(a, b));
}

/// Adds the facets of an element whose lowest node is `node`.
inline void add_facets(const ElementView& element, NodeId node, RowCounter<FacetRest>& facets) {
  const ElementShape& shape = *element.shape;
  if (shape.dimension == 3 && shape.node_count == 4) {
    NodeId higher[4];
    int count = 0;
    for (int n = 0; n < 4; ++n) {  // branch-free: a branch would be unpredictable
      higher[count] = element.nodes[n];
      count += element.nodes[n] > node ? 1 : 0;
    }
    if (count >= 2) facets.add({ordered_pair(higher[0], higher[1]), -1});
    if (count == 3) {
      facets.add({ordered_pair(higher[0], higher[2]), -1});
      facets.add({ordered_pair(higher[1], higher[2]), -1});
    }
    return;
  }
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetKey key = facet_key(element, f);
    const int skipped = 4 - shape.facets[f].node_count;
    if (key.nodes[skipped] != node) continue;
    const NodeId second = skipped < 2 ? key.nodes[skipped + 2] : key.nodes[skipped + 1];
    facets.add({ordered_pair(key.nodes[skipped + 1], second), skipped == 0 ? key.nodes[3] : -1});
  }
}

/// Calls `visit(node, facet, count)` for each facet, in the ball of its lowest node, with the
/// number of elements that have it.
/// cost   O(ball entries)
template <class Visit>
void count_facets(CpuExecutor& executor, std::size_t node_count, const Elements& elements,
                  const Rows<ElementId>& balls, const Visit& visit) {
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    RowCounter<FacetRest> facets;
    for (std::size_t node = begin; node < end; ++node) {
      facets.clear(balls.size(node) * kMaxNodeFacets);
      for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
        add_facets(elements[*e], static_cast<NodeId>(node), facets);
      }
      for (std::size_t n = 0; n < facets.size(); ++n) {
        visit(static_cast<NodeId>(node), facets[n].key, static_cast<int>(facets[n].count));
      }
    }
  });
}

/// The boundary: each facet is counted in the ball of its lowest node; one that occurs once
/// marks its nodes. Source: Xiao et al. 2019, section 3.3. In a surface mesh a second pass, where
/// it is needed, marks the nodes of edges that occur more than twice.
///
/// gives    `marks[node]` = kOnBoundary, kOnNonManifoldEdge or 0
/// returns  false if a facet of a volume mesh is used more than twice
/// cost     O(ball entries)
[[nodiscard]] inline bool find_boundary(CpuExecutor& executor, std::size_t node_count,
                                        const Elements& elements, const Rows<ElementId>& balls,
                                        std::uint8_t* marks) {
  executor.for_each(node_count, [=](std::size_t node) { marks[node] = 0; });
  const auto mark = [=](NodeId node, const FacetRest& facet, std::uint8_t as) {
    CpuExecutor::store(marks[node], as);
    CpuExecutor::store(marks[facet.first_two >> 32], as);
    CpuExecutor::store(marks[facet.first_two & 0xffffffffU], as);
    if (facet.third >= 0) CpuExecutor::store(marks[facet.third], as);
  };
  std::atomic<bool> overused = false;
  count_facets(executor, node_count, elements, balls,
               [&](NodeId node, const FacetRest& facet, int count) {
                 if (count > 2) overused.store(true, std::memory_order_relaxed);
                 if (count == 1) mark(node, facet, kOnBoundary);
               });
  if (!overused) return true;
  if (elements.runs[0].shape->dimension == 3) return false;
  count_facets(executor, node_count, elements, balls,
               [&](NodeId node, const FacetRest& facet, int count) {
                 if (count > 2) mark(node, facet, kOnNonManifoldEdge);
               });
  return true;
}

}  // namespace meshsmooth::detail
