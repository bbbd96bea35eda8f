#pragma once

#include "smooth/base/sliding_constraints.hpp"

namespace meshsmooth::detail {

/// The regions of a job's elements.
struct Regions {
  const std::int32_t* of_caller = nullptr;  // by the caller's elements; null: one region
  const ElementId* caller_ids = nullptr;    // null: in the caller's order

  [[nodiscard]] MESHSMOOTH_HD ElementId caller(ElementId element) const {
    return caller_ids == nullptr ? element : caller_ids[element];
  }
  [[nodiscard]] MESHSMOOTH_HD std::int32_t operator[](ElementId element) const {
    return of_caller == nullptr ? 0 : of_caller[caller(element)];
  }
};

/// Whether the element has this facet.
MESHSMOOTH_HD inline bool has_facet(const ElementView& element, const FacetKey& key) {
  for (int f = 0; f < element.shape->facet_count; ++f) {
    if (facet_key(element, f) == key) return true;
  }
  return false;
}

/// The node of a facet with the fewest elements: a search there costs little at a hub.
MESHSMOOTH_HD inline std::size_t node_of_smallest_ball(const Rows<ElementId>& balls,
                                                       const FacetKey& key) {
  auto smallest = static_cast<std::size_t>(key.nodes[kMaxFacetNodes - 1]);
  for (const NodeId n : key.nodes) {
    if (n < 0) continue;
    const auto node = static_cast<std::size_t>(n);
    if (balls.size(node) < balls.size(smallest)) smallest = node;
  }
  return smallest;
}

/// Calls `visit(element, facet, between)` for the constrained facets whose lowest node is `node`:
/// used by one element, or by two of different regions (then for the lower one). `fixed` marks
/// all nodes of such facets.
template <class Visitor>
MESHSMOOTH_HD void visit_constrained_facets(const Elements& elements, const Rows<ElementId>& balls,
                                            const Regions& regions, const std::uint8_t* fixed,
                                            std::size_t node, const Visitor& visit) {
  if (fixed[node] == 0) return;
  const ElementId* const end = balls.end(node);
  for (const ElementId* e = balls.begin(node); e != end; ++e) {
    const ElementView element = elements[*e];
    for (int f = 0; f < element.shape->facet_count; ++f) {
      const FacetShape& shape = element.shape->facets[f];
      const FacetKey key = facet_key(element, f);
      if (key.nodes[4 - shape.node_count] != static_cast<NodeId>(node)) continue;
      bool candidate = true;
      for (int n = 0; n < shape.node_count; ++n) {
        candidate = candidate && fixed[element.nodes[shape.nodes[n]]] != 0;
      }
      if (!candidate) continue;
      const std::size_t around = node_of_smallest_ball(balls, key);
      const ElementId* other = balls.begin(around);
      const ElementId* const last = balls.end(around);
      while (other != last && (*other == *e || !has_facet(elements[*other], key))) ++other;
      if (other == last) {
        visit(*e, f, false);
      } else if (regions[*e] < regions[*other]) {
        visit(*e, f, true);
      }
    }
  }
}

/// The facet of these nodes with its normal at the given positions.
template <class Real>
MESHSMOOTH_HD ConstrainedFacet constrained_facet(const NodeId* nodes, int node_count,
                                                 std::uint64_t name, bool between,
                                                 const Vec3<Real>* positions) {
  ConstrainedFacet result{{-1, -1, -1, -1}, {0, 0, 0}, name, between};
  for (int n = 0; n < node_count; ++n) result.nodes[n] = nodes[n];
  result.normal = normal_of(result, [&](NodeId n) { return vec3_cast<double>(positions[n]); });
  return result;
}

}  // namespace meshsmooth::detail
