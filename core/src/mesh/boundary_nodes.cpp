#include "mesh/boundary_nodes.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <span>

#include "mesh/parallel.hpp"
#include "meshsmooth/mesh.hpp"

namespace meshsmooth {
namespace {

using detail::parallel_for_ranges;

struct Facet {
  std::array<NodeId, kMaxFacetNodes> corners;  // ascending; those of shorter ones begin by -1
  const NodeId* nodes;                         // of its element
  ElementType type;
  std::int8_t number;  // in the element
  std::int32_t region;

  [[nodiscard]] std::size_t lowest() const {
    return static_cast<std::size_t>(
        *std::ranges::find_if(corners, [](NodeId n) { return n >= 0; }));
  }
};

std::vector<Facet> list_facets(const TopologyView& topology) {
  std::size_t count = 0;
  for (const ElementBlockView& block : topology.blocks) {
    count +=
        block.element_count() * static_cast<std::size_t>(element_shape(block.type).facet_count);
  }
  std::vector<Facet> facets(count);
  std::size_t first_facet = 0, first_element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    const auto per_element = static_cast<std::size_t>(shape.facet_count);
    parallel_for_ranges(block.element_count(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t e = begin; e < end; ++e) {
        const NodeId* const nodes = &block.nodes[e * element_width(block.type)];
        const std::int32_t region =
            topology.regions.empty() ? 0 : topology.regions[first_element + e];
        for (std::size_t f = 0; f < per_element; ++f) {
          Facet& facet = facets[first_facet + e * per_element + f];
          facet = {{-1, -1, -1, -1}, nodes, block.type, static_cast<std::int8_t>(f), region};
          for (int n = 0; n < shape.facets[f].node_count; ++n) {
            facet.corners[n] = nodes[shape.facets[f].nodes[n]];
          }
          std::ranges::sort(facet.corners);
        }
      }
    });
    first_facet += block.element_count() * per_element;
    first_element += block.element_count();
  }
  return facets;
}

/// Indices of facets by their lowest corner, ascending in each row.
struct Rows {
  std::vector<std::size_t> first;  // of each node, and the end
  std::vector<std::size_t> facets;
};

Rows sort_by_lowest_corner(const std::vector<Facet>& facets, std::size_t node_count) {
  Rows rows{std::vector<std::size_t>(node_count + 2), std::vector<std::size_t>(facets.size())};
  for (const Facet& facet : facets) ++rows.first[facet.lowest() + 2];
  for (std::size_t n = 2; n < rows.first.size(); ++n) rows.first[n] += rows.first[n - 1];
  for (std::size_t f = 0; f < facets.size(); ++f) {
    rows.facets[rows.first[facets[f].lowest() + 1]++] = f;
  }
  return rows;
}

/// Visits the corners of a facet and the nodes in the middle of them.
template <class Visit>
void visit_nodes(const Facet& facet, const Visit& visit) {
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
  const std::vector<Facet> facets = list_facets(topology);
  Rows rows = sort_by_lowest_corner(facets, topology.node_count);
  std::vector<std::uint8_t> on_boundary(topology.node_count);
  const auto mark = [&](NodeId node) {
    std::atomic_ref(on_boundary[static_cast<std::size_t>(node)])
        .store(1, std::memory_order_relaxed);
  };
  parallel_for_ranges(topology.node_count, [&](std::size_t begin, std::size_t end) {
    const auto corners = [&](std::size_t f) { return facets[f].corners; };
    const auto region = [&](std::size_t f) { return facets[f].region; };
    for (std::size_t node = begin; node < end; ++node) {
      const std::span row(rows.facets.data() + rows.first[node],
                          rows.first[node + 1] - rows.first[node]);
      std::ranges::sort(row, {}, corners);
      for (auto first = row.begin(), last = first; first != row.end(); first = last) {
        last = std::upper_bound(first, row.end(), corners(*first),
                                [&](const auto& c, std::size_t f) { return c < corners(f); });
        const std::span same(first, last);
        const auto [lowest, highest] = std::ranges::minmax(same, {}, region);
        if (same.size() > 1 && !(between_regions && region(lowest) != region(highest))) continue;
        for (const std::size_t f : same) visit_nodes(facets[f], mark);
      }
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
  return facet_count * (static_cast<std::int64_t>(sizeof(Facet)) + offset) +
         node_count * (offset + 1 + list) + 2 * offset;
}

}  // namespace meshsmooth
