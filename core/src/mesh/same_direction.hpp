#pragma once

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// Whether two elements run through their common facet in the same direction: then one of them is
/// numbered the other way round.
///
/// @param a,b  the nodes of the elements, by index
template <class NodesA, class NodesB>
[[nodiscard]] MESHSMOOTH_HD bool same_direction(const FacetShape& in_a, const NodesA& a,
                                                const FacetShape& in_b, const NodesB& b) {
  const NodeId first = a[in_a.nodes[0]], second = a[in_a.nodes[1]];
  const int count = in_b.node_count;
  if (count == 2) return b[in_b.nodes[0]] == first;
  for (int n = 0; n < count; ++n) {
    if (b[in_b.nodes[n]] == first) return b[in_b.nodes[(n + 1) % count]] == second;
  }
  return false;
}

}  // namespace meshsmooth::detail
