#include <algorithm>
#include <array>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth {

std::vector<NodeId> find_boundary_nodes(const TopologyView& topology) {
  using Facet = std::array<NodeId, kMaxFacetNodes>;  // ascending; those of shorter ones begin by -1
  std::vector<Facet> facets;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e) {
      const NodeId* const nodes = &block.nodes[e * element_width(block.type)];
      for (int f = 0; f < shape.facet_count; ++f) {
        Facet facet{-1, -1, -1, -1};
        for (int n = 0; n < shape.facets[f].node_count; ++n) {
          facet[n] = nodes[shape.facets[f].nodes[n]];
        }
        std::ranges::sort(facet);
        facets.push_back(facet);
      }
    }
  }
  std::ranges::sort(facets);
  std::vector<NodeId> boundary;
  for (std::size_t first = 0, last = 0; first < facets.size(); first = last) {
    while (last < facets.size() && facets[last] == facets[first]) ++last;
    if (last - first > 1) continue;
    for (const NodeId node : facets[first]) {
      if (node >= 0) boundary.push_back(node);
    }
  }
  std::ranges::sort(boundary);
  boundary.erase(std::unique(boundary.begin(), boundary.end()), boundary.end());
  return boundary;
}

}  // namespace meshsmooth
