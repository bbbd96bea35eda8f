#pragma once

#include "smooth/rules/topology.hpp"

namespace meshsmooth::detail {

/// The nodes of a facet in ascending order; missing ones are -1 and come first.
struct FacetKey {
  NodeId nodes[kMaxFacetNodes];

  friend MESHSMOOTH_HD bool operator<(const FacetKey& a, const FacetKey& b) {
    for (int n = 0; n < kMaxFacetNodes; ++n) {
      if (a.nodes[n] != b.nodes[n]) return a.nodes[n] < b.nodes[n];
    }
    return false;
  }
  friend MESHSMOOTH_HD bool operator==(const FacetKey& a, const FacetKey& b) {
    return !(a < b) && !(b < a);
  }
};

MESHSMOOTH_HD inline FacetKey facet_key(const ElementView& element, int facet) {
  const FacetShape& shape = element.shape->facets[facet];
  static_assert(kMaxFacetNodes == 4, "a key has as many -1 as a facet may have nodes");
  FacetKey key{{-1, -1, -1, -1}};
  for (int n = 0; n < shape.node_count; ++n) {
    const NodeId node = element.nodes[shape.nodes[n]];
    int at = kMaxFacetNodes - shape.node_count + n;
    for (; at > 0 && key.nodes[at - 1] > node; --at) key.nodes[at] = key.nodes[at - 1];
    key.nodes[at] = node;
  }
  return key;
}

}  // namespace meshsmooth::detail
