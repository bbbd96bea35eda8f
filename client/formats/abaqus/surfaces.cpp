#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "model.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {
namespace {

/// The sides of a solid or surface by its nodes from 1, as Abaqus numbers them; 0: no node.
using Sides = std::array<std::array<std::int8_t, 4>, 6>;
constexpr Sides kTriangle = {{{1, 2}, {2, 3}, {3, 1}}};
constexpr Sides kQuad = {{{1, 2}, {2, 3}, {3, 4}, {4, 1}}};
constexpr Sides kTetrahedron = {{{1, 2, 3}, {1, 4, 2}, {2, 4, 3}, {3, 4, 1}}};
constexpr Sides kPyramid = {{{1, 2, 3, 4}, {1, 5, 2}, {2, 5, 3}, {3, 5, 4}, {4, 5, 1}}};
constexpr Sides kWedge = {{{1, 2, 3}, {4, 6, 5}, {1, 4, 5, 2}, {2, 5, 6, 3}, {3, 6, 4, 1}}};
constexpr Sides kHexahedron = {
    {{1, 2, 3, 4}, {5, 8, 7, 6}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 8, 4}, {4, 8, 5, 1}}};

/// The ends of the edges in whose middle an element of second order has its other nodes, in their
/// order.
using Edge = std::array<std::int8_t, 2>;
constexpr Edge kQuadEdges[] = {{1, 2}, {2, 3}, {3, 4}, {4, 1}};
constexpr Edge kTetrahedronEdges[] = {{1, 2}, {2, 3}, {3, 1}, {1, 4}, {2, 4}, {3, 4}};
constexpr Edge kWedgeEdges[] = {{1, 2}, {2, 3}, {3, 1}, {4, 5}, {5, 6},
                                {6, 4}, {1, 4}, {2, 5}, {3, 6}};
constexpr Edge kHexahedronEdges[] = {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 6}, {6, 7},
                                     {7, 8}, {8, 5}, {1, 5}, {2, 6}, {3, 7}, {4, 8}};

struct Shape {
  const Sides* sides;  // null: it has none
  std::size_t corner_count;
  std::span<const Edge> edges;
};

Shape find_shape(int vtk_type, std::size_t node_count) {
  const CellKind* const kind = find_vtk_cell(vtk_type, node_count);
  if (kind == nullptr || !kind->element) return {nullptr, 0, {}};
  switch (linear_type(*kind->element)) {
    case ElementType::triangle:
      return {&kTriangle, 3, std::span(kTetrahedronEdges).first(3)};
    case ElementType::quad:
      return {&kQuad, 4, kQuadEdges};
    case ElementType::tetrahedron:
      return {&kTetrahedron, 4, kTetrahedronEdges};
    case ElementType::pyramid:
      return {&kPyramid, 5, {}};
    case ElementType::wedge:
      return {&kWedge, 6, kWedgeEdges};
    case ElementType::hexahedron:
      return {&kHexahedron, 8, kHexahedronEdges};
    default:
      return {nullptr, 0, {}};
  }
}

}  // namespace

void AbaqusModel::add_to_surface(ScopeId scope, const std::string& name, Entry elements,
                                 AbaqusSide side) {
  Surface& surface = scopes_[scope].surfaces[in_capitals(name)];
  if (surface.name.empty()) surface.name = name;
  surface.parts.push_back({std::move(elements), side});
}

void AbaqusModel::append_side(std::size_t element, AbaqusSide side, NodeSet& set) const {
  const AbaqusElement& type = elements_[element].type;
  const std::span own(corners_.data() + elements_[element].first,
                      end_of(element) - elements_[element].first);
  const Shape shape = find_shape(type.vtk_type, own.size());
  if (shape.sides == nullptr || (side.edge_of_shell && !type.shell)) return;
  const int number = type.shell && !side.edge_of_shell ? side.number - 2 : side.number;
  if (number < 1 || number > 6) return;  // a shell itself
  const auto& corners = (*shape.sides)[static_cast<std::size_t>(number - 1)];
  const auto corner_count = static_cast<std::size_t>(
      std::ranges::count_if(corners, [](std::int8_t corner) { return corner > 0; }));
  if (corner_count == 0) return;
  const auto is_on_side = [&](std::int8_t corner) {
    return std::ranges::find(corners, corner) != corners.end();
  };
  std::vector<std::int64_t> nodes;
  for (std::size_t n = 0; n < corner_count; ++n) {
    nodes.push_back(own[static_cast<std::size_t>(corners[n] - 1)]);
  }
  for (std::size_t edge = 0; edge < shape.edges.size(); ++edge) {
    const std::size_t place = shape.corner_count + edge;
    const auto [a, b] = shape.edges[edge];
    if (place < own.size() && is_on_side(a) && is_on_side(b)) nodes.push_back(own[place]);
  }
  for (const std::int64_t node : nodes) set.nodes.push_back(static_cast<NodeId>(node));
  set.facets.add(nodes, corner_count);
}

void AbaqusModel::store_surfaces(const DeckReader& reader, FileContent& content, Notes& notes) {
  for (ScopeId scope = 0; scope < scopes_.size(); ++scope) {
    for (const auto& [key, surface] : scopes_[scope].surfaces) {
      NodeSet named{surface.name, {}};
      for (const auto& [entry, side] : surface.parts) {
        if (!entry.name.empty() &&
            !sets(entry.scope, Kind::elements).contains(in_capitals(entry.name))) {
          notes.add("no such surface", [&, &part = entry] {
            return reader.describe(part.place) + ": there is no set of elements \"" + part.name +
                   "\" for this surface";
          });
          continue;
        }
        std::vector<std::int64_t> elements;
        resolve(reader, Kind::elements, entry, elements, notes);
        for (const std::int64_t element : elements) {
          append_side(static_cast<std::size_t>(element), side, named);
        }
      }
      if (named.nodes.empty()) continue;
      std::ranges::sort(named.nodes);
      named.nodes.erase(std::unique(named.nodes.begin(), named.nodes.end()), named.nodes.end());
      for (const std::string& alias : names_of(scope)) {
        content.node_sets.push_back({alias + "." + surface.name, named.nodes, named.facets});
      }
      content.node_sets.push_back(std::move(named));
    }
  }
}

}  // namespace meshsmooth::formats
