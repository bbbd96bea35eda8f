#include "cgns/parents.hpp"

#include <algorithm>
#include <map>
#include <span>

#include "cgns/types.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {
namespace {

using Facets = std::vector<std::vector<int>>;

/// The corners of the facets, from the tables of the SIDS, "Unstructured grid element numbering
/// conventions".
const Facets& facets_of(ElementType linear) {
  static const Facets triangle = {{0, 1}, {1, 2}, {2, 0}};
  static const Facets quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  static const Facets tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  static const Facets pyramid = {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  static const Facets wedge = {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}, {0, 2, 1}, {3, 4, 5}};
  static const Facets hexahedron = {{0, 3, 2, 1}, {0, 1, 5, 4}, {1, 2, 6, 5},
                                    {2, 3, 7, 6}, {0, 4, 7, 3}, {4, 5, 6, 7}};
  switch (linear) {
    case ElementType::triangle:
      return triangle;
    case ElementType::quad:
      return quad;
    case ElementType::tetrahedron:
      return tetrahedron;
    case ElementType::pyramid:
      return pyramid;
    case ElementType::wedge:
      return wedge;
    default:
      return hexahedron;
  }
}

/// The node in the middle of these corners, by its place in CGNS' order; -1: there is none.
int middle_of(const CellKind& kind, std::vector<int> corners) {
  const auto places = places_in(NodeOrder::cgns, kind);
  std::ranges::sort(corners);
  std::size_t node = element_width(linear_type(*kind.element));
  for (const MidNode& mid : mid_nodes(*kind.element)) {
    std::vector<int> of;
    for (const std::int8_t corner :
         std::span(mid.corners).first(static_cast<std::size_t>(mid.corner_count))) {
      of.push_back(places[static_cast<std::size_t>(corner)]);
    }
    std::ranges::sort(of);
    if (of == corners) return places[node];
    ++node;
  }
  return -1;
}

/// The nodes of a facet, which counts from 1, in CGNS' order; empty: there is no such facet.
std::vector<int> nodes_of_facet(const CellKind& kind, std::int64_t facet) {
  const Facets& facets = facets_of(linear_type(*kind.element));
  if (facet < 1 || facet > static_cast<std::int64_t>(facets.size())) return {};
  const std::vector<int>& corners = facets[static_cast<std::size_t>(facet - 1)];
  std::vector<int> nodes = corners;
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    if (corners.size() == 2 && corner == 1) break;  // an edge has one middle
    const int middle = middle_of(kind, {corners[corner], corners[(corner + 1) % corners.size()]});
    if (middle >= 0) nodes.push_back(middle);
  }
  const int middle = corners.size() > 2 ? middle_of(kind, corners) : -1;
  if (middle >= 0) nodes.push_back(middle);
  return nodes;
}

}  // namespace

bool is_given_by_parents(const CgnsTree& tree, const CgnsSection& section,
                         const std::vector<std::int64_t>& connectivity) {
  return find_cgns_kind(section.type) != nullptr &&
         tree.has_data(section.node + "/ParentElements") &&
         std::ranges::all_of(connectivity, [](std::int64_t node) { return node == 0; });
}

std::vector<std::int64_t> connectivity_by_parents(const CgnsTree& tree,
                                                  const std::vector<CgnsSection>& sections,
                                                  const CgnsSection& section) {
  const auto count = static_cast<std::size_t>(section.size());
  const std::vector<std::int64_t> parents = tree.integers(section.node + "/ParentElements");
  const std::vector<std::int64_t> facets = tree.integers(section.node + "/ParentElementsPosition");
  if (parents.size() != 2 * count || facets.size() != 2 * count) {
    tree.fail("\"" + section.node + "\" has not two parents an element");
  }
  std::map<std::int64_t, std::vector<std::int64_t>> streams;  // by the first element of a section
  std::vector<std::int64_t> connectivity;
  for (std::size_t row = 0; row < count; ++row) {
    const std::int64_t parent = parents[row];
    const auto of = std::ranges::find_if(sections, [&](const CgnsSection& other) {
      return parent >= other.first && parent <= other.last;
    });
    const CellKind* kind = of == sections.end() ? nullptr : find_cgns_kind(of->type);
    const auto places =
        kind == nullptr || !kind->element ? std::vector<int>() : nodes_of_facet(*kind, facets[row]);
    if (places.size() != static_cast<std::size_t>(find_cgns_kind(section.type)->node_count)) {
      tree.fail("\"" + section.node + "\" has no nodes, and element " +
                std::to_string(section.first + static_cast<std::int64_t>(row)) +
                " is no facet of element " + std::to_string(parent));
    }
    const auto known = streams.find(of->first);
    const std::vector<std::int64_t>& stream =
        known != streams.end()
            ? known->second
            : streams.emplace(of->first, tree.integers(of->node + "/ElementConnectivity"))
                  .first->second;
    const auto width = static_cast<std::size_t>(kind->node_count);
    const std::size_t first = static_cast<std::size_t>(parent - of->first) * width;
    if (first + width > stream.size()) tree.fail("\"" + of->node + "\" has too few nodes");
    for (const int place : places) {
      connectivity.push_back(stream[first + static_cast<std::size_t>(place)]);
    }
  }
  return connectivity;
}

}  // namespace meshsmooth::formats
