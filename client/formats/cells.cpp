#include "cells.hpp"

#include <algorithm>
#include <array>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

constexpr auto kKinds = std::to_array<CellKind>({
    {"point", kVertexCell, 15, 0, 1, std::nullopt},
    {"edge", kLineCell, 1, 1, 2, std::nullopt},
    {"triangle", kTriangleCell, 2, 2, 3, ElementType::triangle},
    {"quad", kQuadCell, 3, 2, 4, ElementType::quad},
    {"tetrahedron", kTetrahedronCell, 4, 3, 4, ElementType::tetrahedron},
    {"pyramid", kPyramidCell, 7, 3, 5, ElementType::pyramid},
    {"wedge", kWedgeCell, 6, 3, 6, ElementType::wedge},
    {"hexahedron", kHexahedronCell, 5, 3, 8, ElementType::hexahedron},
    {"edge3", kEdge3Cell, 8, 1, 3, std::nullopt},
    {"triangle6", kTriangle6Cell, 9, 2, 6, ElementType::triangle6},
    {"quad8", kQuad8Cell, 16, 2, 8, ElementType::quad8},
    {"quad9", kQuad9Cell, 10, 2, 9, ElementType::quad9},
    {"tetrahedron10", kTetrahedron10Cell, 11, 3, 10, ElementType::tetrahedron10},
    {"pyramid13", kPyramid13Cell, 19, 3, 13, ElementType::pyramid13},
    {"wedge15", kWedge15Cell, 18, 3, 15, ElementType::wedge15},
    {"wedge18", kWedge18Cell, 13, 3, 18, ElementType::wedge18},
    {"hexahedron20", kHexahedron20Cell, 17, 3, 20, ElementType::hexahedron20},
    {"hexahedron27", kHexahedron27Cell, 12, 3, 27, ElementType::hexahedron27},
});
static_assert(std::ranges::all_of(kKinds, [](const CellKind& kind) {
  return static_cast<std::size_t>(kind.node_count) <= kMaxCellNodes &&
         (!kind.element ||
          static_cast<std::size_t>(kind.node_count) == element_width(*kind.element));
}));

template <class Rule>
const CellKind* find_kind(Rule rule) {
  const auto* found = std::find_if(kKinds.begin(), kKinds.end(), rule);
  return found == kKinds.end() ? nullptr : found;
}

}  // namespace

const CellKind* find_vtk_cell(int vtk_type, std::size_t node_count) {
  if (vtk_type == kPolygonCell && node_count == 3) vtk_type = kTriangleCell;
  if (vtk_type == kPolygonCell && node_count == 4) vtk_type = kQuadCell;
  return find_kind([&](const CellKind& kind) {
    return kind.vtk_type == vtk_type && static_cast<std::size_t>(kind.node_count) == node_count;
  });
}

const CellKind* find_vtk_cell(int vtk_type) {
  return find_kind([&](const CellKind& kind) { return kind.vtk_type == vtk_type; });
}

std::optional<int> cell_dimension(int vtk_type, std::size_t node_count) {
  if (const CellKind* kind = find_vtk_cell(vtk_type, node_count)) return kind->dimension;
  if (vtk_type == kPolyVertexCell) return 0;
  if (vtk_type == kPolyLineCell) return 1;
  return std::nullopt;
}

const CellKind* find_gmsh_cell(int gmsh_type) {
  return find_kind([&](const CellKind& kind) { return kind.gmsh_type == gmsh_type; });
}

const CellKind& cell_kind(ElementType type) {
  return *find_kind([&](const CellKind& kind) { return kind.element == type; });
}

std::size_t corner_count(const CellKind& kind) {
  if (kind.element) return element_width(linear_type(*kind.element));
  return static_cast<std::size_t>(kind.dimension) + 1;
}

bool is_second_order(const CellKind& kind) {
  return kind.vtk_type == kEdge3Cell || (kind.element && is_second_order(*kind.element));
}

}  // namespace meshsmooth::formats
