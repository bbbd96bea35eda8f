#pragma once

// Rings and boundary as the paper finds them, by sorting: independent of how the backends do.

#include <algorithm>

#include "smooth/base/rows.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cpu/cpu_executor.hpp"

namespace meshsmooth::detail {

/// The rings, as in the paper: every edge of every element written both ways,
/// sorted, made unique, cut into rows. Reference of the backends' ways. Source: Xiao et al. 2019,
/// section 3.2.
///
/// takes  the elements; `caller_ids` maps node ids to the caller's
/// gives  per node its neighbours along edges, ascending by the caller's id
/// cost   O(edges log edges), 16 B per directed edge of every element while it runs
inline RowBuffer<CpuExecutor, NodeId> find_rings_by_sorting(CpuExecutor& executor,
                                                            std::size_t node_count,
                                                            const Elements& elements,
                                                            const NodeId* caller_ids) {
  auto first_key = executor.allocate<std::int64_t>(elements.count + 1);
  std::int64_t* const first = first_key.data();
  executor.for_each(elements.count + 1, [=](std::size_t e) {
    first[e] = e < elements.count ? 2 * elements[e].shape->edge_count : 0;
  });
  auto key_count = static_cast<std::size_t>(executor.exclusive_scan(first, elements.count + 1));
  auto keys = executor.allocate<std::uint64_t>(key_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(elements.count, [=](std::size_t e) {
    const ElementView element = elements[e];
    for (int edge = 0; edge < element.shape->edge_count; ++edge) {
      const auto a = static_cast<std::uint64_t>(element.nodes[element.shape->edges[edge][0]]);
      const auto b = static_cast<std::uint64_t>(element.nodes[element.shape->edges[edge][1]]);
      key[first[e] + 2 * edge] = (a << 32) | b;
      key[first[e] + 2 * edge + 1] = (b << 32) | a;
    }
  });
  executor.sort(key, key_count);
  key_count = static_cast<std::size_t>(std::unique(key, key + key_count) - key);

  RowBuffer<CpuExecutor, NodeId> rings;
  rings.offsets = executor.allocate<std::int64_t>(node_count + 1);
  rings.entries = executor.allocate<NodeId>(key_count);
  std::int64_t* const offsets = rings.offsets.data();
  NodeId* const entries = rings.entries.data();
  executor.for_each(node_count + 1, [=](std::size_t node) {
    std::size_t low = 0;  // first key of a row >= node
    for (std::size_t high = key_count; low < high;) {
      const std::size_t middle = low + (high - low) / 2;
      if ((key[middle] >> 32) < node) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    offsets[node] = static_cast<std::int64_t>(low);
  });
  executor.for_each(key_count,
                    [=](std::size_t k) { entries[k] = static_cast<NodeId>(key[k] & 0xffffffffU); });
  executor.for_each(node_count, [=](std::size_t node) {
    sort_row(entries + offsets[node], static_cast<std::size_t>(offsets[node + 1] - offsets[node]),
             [=](NodeId n) { return caller_ids[n]; });
  });
  return rings;
}

/// The boundary, as in the paper: all facets sorted; one that stands alone
/// marks its nodes. Reference of the backends' ways.
/// Source: Xiao et al. 2019, section 3.3.
///
/// gives  `on_boundary[node]` = 1 for nodes of facets used once, else 0; returns
///        whether no facet is used more than twice
/// cost   O(facets log facets), 16 B a facet of every element while it runs
[[nodiscard]] inline bool find_boundary_by_sorting(CpuExecutor& executor, std::size_t node_count,
                                                   const Elements& elements,
                                                   std::uint8_t* on_boundary) {
  auto first_key = executor.allocate<std::int64_t>(elements.count + 1);
  std::int64_t* const first = first_key.data();
  executor.for_each(elements.count + 1, [=](std::size_t e) {
    first[e] = e < elements.count ? elements[e].shape->facet_count : 0;
  });
  const auto count = static_cast<std::size_t>(executor.exclusive_scan(first, elements.count + 1));
  auto keys = executor.allocate<FacetKey>(count);
  FacetKey* const key = keys.data();
  executor.for_each(elements.count, [=](std::size_t e) {
    const ElementView element = elements[e];
    for (int f = 0; f < element.shape->facet_count; ++f) key[first[e] + f] = facet_key(element, f);
  });
  executor.sort(key, count);
  executor.for_each(node_count, [=](std::size_t node) { on_boundary[node] = 0; });
  const bool overused = executor.reduce(
      count, false,
      [=](std::size_t k) {
        const bool as_before = k > 0 && key[k - 1] == key[k];
        const bool as_after = k + 1 < count && key[k + 1] == key[k];
        if (!as_before && !as_after) {
          for (const NodeId node : key[k].nodes) {
            if (node >= 0) CpuExecutor::store(on_boundary[node], std::uint8_t{1});
          }
        }
        return as_before && as_after;
      },
      [](bool a, bool b) { return a || b; });
  return !overused;
}

}  // namespace meshsmooth::detail
