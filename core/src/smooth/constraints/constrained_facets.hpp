#pragma once

#include "smooth/constraints/sliding_constraints.hpp"
#include "smooth/steps/boundary.hpp"
#include "smooth/steps/executor.hpp"

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
        fixed[node] = 1;
        return InterfaceCounts{1, was_free ? 1 : 0};
      },
      [] MESHSMOOTH_HD(const InterfaceCounts& a, const InterfaceCounts& b) { return a + b; });
}

/// Whether the element has this facet.
MESHSMOOTH_HD inline bool has_facet(const ElementView& element, const FacetKey& key) {
  for (int f = 0; f < element.shape->facet_count; ++f) {
    if (facet_key(element, f) == key) return true;
  }
  return false;
}

/// Calls `body(element, facet, between)` for the facets of which `node` is the lowest node
/// that one element uses, or two of different regions: then from the lower one. `fixed`
/// holds all nodes of such facets.
template <class Body>
MESHSMOOTH_HD void visit_constrained_facets(const Elements& elements, const Rows<ElementId>& balls,
                                            const Regions& regions, const std::uint8_t* fixed,
                                            std::size_t node, const Body& body) {
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
      const ElementId* other = balls.begin(node);
      while (other != end && (other == e || !has_facet(elements[*other], key))) ++other;
      if (other == end) {
        body(*e, f, false);
      } else if (regions[*e] < regions[*other]) {
        body(*e, f, true);
      }
    }
  }
}

/// The facet with its normal, as it lies.
template <class Real>
MESHSMOOTH_HD ConstrainedFacet constrained_facet(const ElementView& element, int facet,
                                                 std::uint64_t name, bool between,
                                                 const Vec3<Real>* positions) {
  const FacetShape& shape = element.shape->facets[facet];
  ConstrainedFacet result{{-1, -1, -1, -1}, {0, 0, 0}, name, between};
  for (int n = 0; n < shape.node_count; ++n) result.nodes[n] = element.nodes[shape.nodes[n]];
  result.normal = normal_of(result, [&](NodeId n) { return vec3_cast<double>(positions[n]); });
  return result;
}

/// The facets that keep their place: on the boundary, and between regions.
///
/// takes  `fixed`: 1 for the nodes of the boundary and between regions, and for others
/// gives  the facets by their lowest node, in the order of its ball
/// cost   O(facets * elements of a ball) around the fixed nodes; 64 B a facet, 8 B a node
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
          *next++ = constrained_facet(elements[e], f, name, between, positions);
        });
  });
  return facets;
}

}  // namespace meshsmooth::detail
