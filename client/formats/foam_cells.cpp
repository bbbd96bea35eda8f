#include "foam_cells.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "cells.hpp"
#include "meshsmooth/element.hpp"

namespace meshsmooth::formats {
namespace {

/// A triangle or quad seen from outside; a triangle's last node is -1.
using Facet = std::array<std::int64_t, kMaxFacetNodes>;

std::size_t size_of(const Facet& facet) { return facet.back() < 0 ? 3 : 4; }

bool has(const Facet& facet, std::int64_t node) {
  return std::ranges::find(facet, node) != facet.end();
}

/// Turned until its smallest node is the first.
Facet normalized(Facet facet) {
  const auto end = facet.begin() + static_cast<std::ptrdiff_t>(size_of(facet));
  std::rotate(facet.begin(), std::min_element(facet.begin(), end), end);
  return facet;
}

struct CellFacets {
  std::array<Facet, kMaxElementFacets> all;
  std::size_t count = 0;
  std::size_t triangles = 0;

  [[nodiscard]] std::span<const Facet> view() const { return {all.data(), count}; }
};

/// None where a face is neither a triangle nor a quad, or there are too many.
std::optional<CellFacets> facets_of(const FoamFaces& faces, std::span<const FoamCellFace> of_cell) {
  if (of_cell.size() > kMaxElementFacets) return std::nullopt;
  CellFacets found;
  for (const auto& [face, turned] : of_cell) {
    const std::size_t size = faces.node_count(static_cast<std::size_t>(face));
    if (size != 3 && size != 4) return std::nullopt;
    const std::int64_t* nodes = faces.nodes_of(static_cast<std::size_t>(face));
    Facet& facet = found.all[found.count++];
    facet.back() = -1;
    std::copy_n(nodes, size, facet.begin());
    if (turned) std::reverse(facet.begin(), facet.begin() + static_cast<std::ptrdiff_t>(size));
    found.triangles += size == 3 ? 1 : 0;
  }
  return found;
}

std::optional<ElementType> type_of(const CellFacets& facets) {
  const std::size_t quads = facets.count - facets.triangles;
  if (facets.triangles == 4 && quads == 0) return ElementType::tetrahedron;
  if (facets.triangles == 4 && quads == 1) return ElementType::pyramid;
  if (facets.triangles == 2 && quads == 3) return ElementType::wedge;
  if (facets.triangles == 0 && quads == 6) return ElementType::hexahedron;
  return std::nullopt;
}

/// The node behind `node`, along an edge that leaves the base; -1: there is none.
std::int64_t node_above(const CellFacets& facets, const Facet& base, std::int64_t node) {
  for (const Facet& facet : facets.view()) {
    const std::size_t size = size_of(facet);
    for (std::size_t corner = 0; corner < size; ++corner) {
      if (facet[corner] != node) continue;
      for (const std::size_t step : {std::size_t{1}, size - 1}) {
        const std::int64_t next = facet[(corner + step) % size];
        if (!has(base, next)) return next;
      }
    }
  }
  return -1;
}

/// The nodes in VTK's order, if the facets are those of such an element.
std::vector<std::int64_t> order_nodes(ElementType type, const CellFacets& facets) {
  const std::size_t base_size =
      type == ElementType::tetrahedron || type == ElementType::wedge ? 3 : 4;
  const Facet base = *std::ranges::find(facets.view(), base_size, size_of);
  std::vector<std::int64_t> nodes(base.begin(),
                                  base.begin() + static_cast<std::ptrdiff_t>(base_size));
  if (type != ElementType::wedge) std::reverse(nodes.begin(), nodes.end());  // it looks inward
  const auto node_count = element_width(type);
  for (std::size_t corner = 0; nodes.size() < node_count; ++corner) {
    nodes.push_back(node_above(facets, base, nodes[corner]));
  }
  return nodes;
}

bool encloses(ElementType type, const std::vector<std::int64_t>& nodes, const CellFacets& facets) {
  const ElementShape& shape = element_shape(type);
  std::vector<Facet> wanted;
  for (std::size_t index = 0; index < facets.count; ++index) {
    const FacetShape& local = shape.facets[index];
    Facet facet{-1, -1, -1, -1};
    for (std::size_t corner = 0; corner < static_cast<std::size_t>(local.node_count); ++corner) {
      facet[corner] = nodes[static_cast<std::size_t>(local.nodes[corner])];
    }
    wanted.push_back(normalized(facet));
  }
  std::vector<Facet> given;
  for (const Facet& facet : facets.view()) given.push_back(normalized(facet));
  std::ranges::sort(wanted);
  std::ranges::sort(given);
  return wanted == given;
}

void keep_each_once(std::vector<std::int64_t>& nodes) {
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

}  // namespace

void recognize_cell(const FoamFaces& faces, std::span<const FoamCellFace> of_cell, Cell& cell) {
  if (const auto facets = facets_of(faces, of_cell)) {
    if (const auto type = type_of(*facets)) {
      cell.nodes = order_nodes(*type, *facets);
      std::vector<std::int64_t> once = cell.nodes;
      keep_each_once(once);
      if (once.front() >= 0 && once.size() == cell.nodes.size() &&
          encloses(*type, cell.nodes, *facets)) {
        cell.type = cell_kind(*type).vtk_type;
        return;
      }
    }
  }
  cell.type = kPolyhedronCell;
  cell.nodes.clear();
  for (const auto& [face, turned] : of_cell) {
    const auto index = static_cast<std::size_t>(face);
    cell.nodes.insert(cell.nodes.end(), faces.nodes_of(index),
                      faces.nodes_of(index) + faces.node_count(index));
  }
  keep_each_once(cell.nodes);
}

}  // namespace meshsmooth::formats
