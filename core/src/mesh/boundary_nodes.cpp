#include <algorithm>
#include <array>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth {
namespace {

struct Facet {
  std::array<NodeId, kMaxFacetNodes> corners;  // ascending; those of shorter ones begin by -1
  const NodeId* nodes;                         // of its element
  ElementType type;
  std::int8_t number;  // in the element
  std::int32_t region;
};

std::vector<Facet> list_facets(const TopologyView& topology) {
  std::vector<Facet> facets;
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e, ++element) {
      const std::int32_t region = topology.regions.empty() ? 0 : topology.regions[element];
      const NodeId* const nodes = &block.nodes[e * element_width(block.type)];
      for (std::int8_t f = 0; f < shape.facet_count; ++f) {
        Facet facet{{-1, -1, -1, -1}, nodes, block.type, f, region};
        for (int n = 0; n < shape.facets[f].node_count; ++n) {
          facet.corners[n] = nodes[shape.facets[f].nodes[n]];
        }
        std::ranges::sort(facet.corners);
        facets.push_back(facet);
      }
    }
  }
  std::ranges::stable_sort(facets, {}, &Facet::corners);
  return facets;
}

/// Adds the corners of a facet and the nodes in the middle of them.
void add_nodes(const Facet& facet, std::vector<NodeId>& nodes) {
  for (const NodeId node : facet.corners) {
    if (node >= 0) nodes.push_back(node);
  }
  const ElementShape& shape = element_shape(facet.type);
  const FacetShape& own = shape.facets[facet.number];
  const auto in_facet = [&](std::int8_t corner) {
    return std::find(own.nodes.begin(), own.nodes.begin() + own.node_count, corner) !=
           own.nodes.begin() + own.node_count;
  };
  const NodeId* node = facet.nodes + shape.node_count;
  for (const MidNode& mid : mid_nodes(facet.type)) {
    const auto* const end = mid.corners.data() + mid.corner_count;
    if (std::all_of(mid.corners.data(), end, in_facet)) nodes.push_back(*node);
    ++node;
  }
}

}  // namespace

std::vector<NodeId> find_boundary_nodes(const TopologyView& topology, bool between_regions) {
  const std::vector<Facet> facets = list_facets(topology);
  std::vector<NodeId> boundary;
  for (std::size_t first = 0, last = 0; first < facets.size(); first = last) {
    while (last < facets.size() && facets[last].corners == facets[first].corners) ++last;
    const bool outside = last - first == 1;
    if (outside || (between_regions && facets[first].region != facets[last - 1].region)) {
      add_nodes(facets[first], boundary);
      add_nodes(facets[last - 1], boundary);
    }
  }
  std::ranges::sort(boundary);
  boundary.erase(std::unique(boundary.begin(), boundary.end()), boundary.end());
  return boundary;
}

}  // namespace meshsmooth
