#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "model.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {
namespace {

/// The faces of a solid by its nodes from 1, as Abaqus numbers them; 0: no node.
using Faces = std::array<std::array<std::int8_t, 4>, 6>;
constexpr Faces kTetrahedron = {{{1, 2, 3}, {1, 4, 2}, {2, 4, 3}, {3, 4, 1}}};
constexpr Faces kPyramid = {{{1, 2, 3, 4}, {1, 5, 2}, {2, 5, 3}, {3, 5, 4}, {4, 5, 1}}};
constexpr Faces kWedge = {{{1, 2, 3}, {4, 6, 5}, {1, 4, 5, 2}, {2, 5, 6, 3}, {3, 6, 4, 1}}};
constexpr Faces kHexahedron = {
    {{1, 2, 3, 4}, {5, 8, 7, 6}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 8, 4}, {4, 8, 5, 1}}};

/// The ends of the edges in whose middle a solid of second order has its other nodes, in their
/// order.
using Edge = std::array<std::int8_t, 2>;
constexpr Edge kTetrahedronEdges[] = {{1, 2}, {2, 3}, {3, 1}, {1, 4}, {2, 4}, {3, 4}};
constexpr Edge kWedgeEdges[] = {{1, 2}, {2, 3}, {3, 1}, {4, 5}, {5, 6},
                                {6, 4}, {1, 4}, {2, 5}, {3, 6}};
constexpr Edge kHexahedronEdges[] = {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 6}, {6, 7},
                                     {7, 8}, {8, 5}, {1, 5}, {2, 6}, {3, 7}, {4, 8}};

struct Solid {
  const Faces* faces;  // null: it is not a solid
  std::size_t corner_count;
  std::span<const Edge> edges;
};

Solid find_solid(int vtk_type, std::size_t node_count) {
  const CellKind* const kind = find_vtk_cell(vtk_type, node_count);
  if (kind == nullptr || !kind->element) return {nullptr, 0, {}};
  switch (linear_type(*kind->element)) {
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

void AbaqusModel::add_to_surface(ScopeId scope, const std::string& name, Entry elements, int face) {
  Surface& surface = scopes_[scope].surfaces[in_capitals(name)];
  if (surface.name.empty()) surface.name = name;
  surface.parts.push_back({std::move(elements), face});
}

void AbaqusModel::append_face(std::size_t element, int face, std::vector<NodeId>& nodes) const {
  const std::span own(corners_.data() + elements_[element].first,
                      end_of(element) - elements_[element].first);
  const Solid solid = find_solid(elements_[element].type.vtk_type, own.size());
  if (solid.faces == nullptr) return;
  const auto& corners = (*solid.faces)[static_cast<std::size_t>(face - 1)];
  const auto is_on_face = [&](std::int8_t corner) {
    return std::ranges::find(corners, corner) != corners.end();
  };
  const auto add = [&](std::size_t place) { nodes.push_back(static_cast<NodeId>(own[place])); };
  for (const std::int8_t corner : corners) {
    if (corner > 0) add(static_cast<std::size_t>(corner - 1));
  }
  for (std::size_t edge = 0; edge < solid.edges.size(); ++edge) {
    const std::size_t place = solid.corner_count + edge;
    const auto [a, b] = solid.edges[edge];
    if (place < own.size() && is_on_face(a) && is_on_face(b)) add(place);
  }
}

void AbaqusModel::store_surfaces(const DeckReader& reader, FileContent& content, Notes& notes) {
  for (ScopeId scope = 0; scope < scopes_.size(); ++scope) {
    for (const auto& [key, surface] : scopes_[scope].surfaces) {
      NodeSet named{surface.name, {}, true};
      for (const auto& [entry, face] : surface.parts) {
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
          append_face(static_cast<std::size_t>(element), face, named.nodes);
        }
      }
      if (named.nodes.empty()) continue;
      std::ranges::sort(named.nodes);
      named.nodes.erase(std::unique(named.nodes.begin(), named.nodes.end()), named.nodes.end());
      for (const std::string& alias : names_of(scope)) {
        content.node_sets.push_back({alias + "." + surface.name, named.nodes, true});
      }
      content.node_sets.push_back(std::move(named));
    }
  }
}

}  // namespace meshsmooth::formats
