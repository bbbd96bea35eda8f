#include "cells.hpp"

#include <algorithm>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::array<std::int8_t, 8> kSame = {0, 1, 2, 3, 4, 5, 6, 7};

// VTK lets the normal of a wedge's first triangle point out of the wedge, Gmsh
// into it.
constexpr std::array<std::int8_t, 8> kOtherTurn = {0, 2, 1, 3, 5, 4, 6, 7};

constexpr std::array<CellKind, 8> kKinds = {{
    {"point", kVertexCell, 15, 0, 1, std::nullopt, kSame},
    {"edge", kLineCell, 1, 1, 2, std::nullopt, kSame},
    {"triangle", kTriangleCell, 2, 2, 3, ElementType::triangle, kSame},
    {"quad", kQuadCell, 3, 2, 4, ElementType::quad, kSame},
    {"tetrahedron", kTetrahedronCell, 4, 3, 4, ElementType::tetrahedron, kSame},
    {"pyramid", kPyramidCell, 7, 3, 5, ElementType::pyramid, kSame},
    {"wedge", kWedgeCell, 6, 3, 6, ElementType::wedge, kOtherTurn},
    {"hexahedron", kHexahedronCell, 5, 3, 8, ElementType::hexahedron, kSame},
}};

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

}  // namespace meshsmooth::formats
