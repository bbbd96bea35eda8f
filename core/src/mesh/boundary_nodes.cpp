#include "mesh/boundary_nodes.hpp"

#include <algorithm>
#include <atomic>
#include <span>

#include "mesh/facet_rows.hpp"
#include "mesh/parallel.hpp"
#include "meshsmooth/mesh.hpp"

namespace meshsmooth {
namespace {

/// Visits the corners of a facet and the nodes in the middle of them.
template <class Visit>
void visit_nodes(const detail::FacetUse& facet, const Visit& visit) {
  const ElementShape& shape = element_shape(facet.type);
  const FacetShape& own = shape.facets[facet.number];
  for (int n = 0; n < own.node_count; ++n) visit(facet.nodes[own.nodes[n]]);
  const auto in_facet = [&](std::int8_t corner) {
    return std::find(own.nodes.begin(), own.nodes.begin() + own.node_count, corner) !=
           own.nodes.begin() + own.node_count;
  };
  const NodeId* node = facet.nodes + shape.node_count;
  for (const MidNode& mid : mid_nodes(facet.type)) {
    const auto* const end = mid.corners.data() + mid.corner_count;
    if (std::all_of(mid.corners.data(), end, in_facet)) visit(*node);
    ++node;
  }
}

}  // namespace

std::vector<NodeId> find_boundary_nodes(const TopologyView& topology, bool between_regions) {
  const detail::FacetRows rows(topology);
  std::vector<std::uint8_t> on_boundary(topology.node_count);
  const auto mark = [&](NodeId node) {
    std::atomic_ref(on_boundary[static_cast<std::size_t>(node)])
        .store(1, std::memory_order_relaxed);
  };
  const auto region = [&](const detail::FacetUse& use) {
    return topology.regions.empty() ? 0 : topology.regions[use.element];
  };
  detail::parallel_for_ranges(topology.node_count, [&](std::size_t begin, std::size_t end) {
    std::vector<detail::FacetUse> row;
    for (std::size_t node = begin; node < end; ++node) {
      rows.visit_row(node, row, [&](std::span<const detail::FacetUse> uses) {
        const auto [lowest, highest] = std::ranges::minmax(uses, {}, region);
        if (uses.size() == 2 && !(between_regions && region(lowest) != region(highest))) return;
        for (const detail::FacetUse& use : uses) visit_nodes(use, mark);
      });
    }
  });
  std::vector<NodeId> boundary;
  for (std::size_t node = 0; node < on_boundary.size(); ++node) {
    if (on_boundary[node] != 0) boundary.push_back(static_cast<NodeId>(node));
  }
  return boundary;
}

std::int64_t detail::boundary_nodes_bytes(std::int64_t node_count, std::int64_t facet_count) {
  // A list that grows has up to twice its size, and the one before beside it.
  constexpr auto offset = static_cast<std::int64_t>(sizeof(std::size_t));
  const std::int64_t list = 3 * static_cast<std::int64_t>(sizeof(NodeId));
  return facet_count * offset + node_count * (offset + 1 + list) + 2 * offset;
}

}  // namespace meshsmooth
