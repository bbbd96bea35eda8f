#pragma once

#include "smooth/base/executor.hpp"
#include "smooth/constraints/constrained_facets.hpp"

namespace meshsmooth::detail {

/// The nodes between regions.
struct InterfaceCounts {
  std::int64_t nodes = 0;
  std::int64_t were_free = 0;  // and are fixed now

  friend MESHSMOOTH_HD InterfaceCounts operator+(const InterfaceCounts& a,
                                                 const InterfaceCounts& b) {
    return {a.nodes + b.nodes, a.were_free + b.were_free};
  }
};

/// Fixes the nodes between regions: those with elements of more than one.
///
/// gives  1 in `fixed` for them
/// cost   O(ball entries)
template <Executor E>
InterfaceCounts fix_interfaces(E& executor, std::size_t node_count, const Rows<ElementId>& balls,
                               const Regions& regions, std::uint8_t* fixed) {
  return executor.reduce(
      node_count, InterfaceCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const ElementId* e = balls.begin(node);
        const ElementId* const end = balls.end(node);
        if (e == end) return InterfaceCounts{};
        const std::int32_t first = regions[*e];
        while (e != end && regions[*e] == first) ++e;
        if (e == end) return InterfaceCounts{};
        const bool was_free = fixed[node] == 0;
        if (was_free) fixed[node] = 1;
        return InterfaceCounts{1, was_free ? 1 : 0};
      },
      Plus{});
}

/// Finds the constrained facets: on the boundary, and between regions.
///
/// takes  `fixed`: 1 for the nodes of the boundary and between regions, and for others
/// gives  the facets by their lowest node, in the order of its ball
/// cost   O(facets * smallest ball of their nodes) around the fixed nodes; 64 B a facet, 8 B a node
///        while it runs
template <Executor E, class Real>
typename E::template Buffer<ConstrainedFacet> find_constrained_facets(
    E& executor, std::size_t node_count, const Elements& elements, const Rows<ElementId>& balls,
    const Regions& regions, const std::uint8_t* fixed, const Vec3<Real>* positions) {
  auto first_facet = executor.template allocate<std::int64_t>(node_count + 1);
  std::int64_t* const first = first_facet.data();
  executor.for_each(node_count + 1, [=] MESHSMOOTH_HD(std::size_t node) {
    std::int64_t count = 0;
    if (node < node_count) {
      visit_constrained_facets(elements, balls, regions, fixed, node,
                               [&](ElementId, int, bool) { ++count; });
    }
    first[node] = count;
  });
  const std::int64_t count = executor.exclusive_scan(first, node_count + 1);
  auto facets = executor.template allocate<ConstrainedFacet>(static_cast<std::size_t>(count));
  ConstrainedFacet* const out = facets.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    ConstrainedFacet* next = out + first[node];
    visit_constrained_facets(
        elements, balls, regions, fixed, node, [&](ElementId e, int f, bool between) {
          const std::uint64_t name =
              std::uint64_t{regions.caller(e)} << 3 | static_cast<unsigned>(f);
          const ElementView element = elements[e];
          const FacetShape& shape = element.shape->facets[f];
          NodeId nodes[kMaxFacetNodes];
          for (int n = 0; n < shape.node_count; ++n) nodes[n] = element.nodes[shape.nodes[n]];
          *next++ = constrained_facet(nodes, shape.node_count, name, between, positions);
        });
  });
  return facets;
}

/// The elements of a surface mesh as facets: facet e is element e.
/// cost   O(elements); 64 B each
template <Executor E, class Real>
typename E::template Buffer<ConstrainedFacet> facets_of_elements(E& executor,
                                                                 const Elements& elements,
                                                                 const Regions& regions,
                                                                 const Vec3<Real>* positions) {
  auto facets = executor.template allocate<ConstrainedFacet>(elements.count);
  ConstrainedFacet* const out = facets.data();
  executor.for_each(elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = elements[e];
    out[e] = constrained_facet(element.nodes, element.shape->node_count,
                               regions.caller(static_cast<ElementId>(e)), false, positions);
  });
  return facets;
}

}  // namespace meshsmooth::detail
