#pragma once

#include <optional>
#include <string_view>

#include "meshsmooth/element.hpp"

namespace meshsmooth::formats {

/// The end of a message that refuses an element.
inline constexpr const char* kSupportedElements =
    "only linear triangles, quads, tetrahedra, pyramids, wedges and hexahedra and those of second "
    "order with 6, 8, 9, 10, 13, 15, 18, 20 or 27 nodes can be smoothed";

/// A cell, linear or of second order, as the libraries call it.
struct CellKind {
  std::string_view name;
  int vtk_type;
  int gmsh_type;
  int dimension;
  int node_count;
  std::optional<ElementType> element;  // none for points and edges
};

inline constexpr std::size_t kMaxCellNodes = 27;

/// Null for a type that cannot travel (higher order, polyhedra …).
[[nodiscard]] const CellKind* find_vtk_cell(int vtk_type, std::size_t node_count);
/// Of a type that has one number of nodes only; null for others.
[[nodiscard]] const CellKind* find_vtk_cell(int vtk_type);
/// Of a cell that may be a lower-dimensional cell or part of a mesh; none: it may be neither.
[[nodiscard]] std::optional<int> cell_dimension(int vtk_type, std::size_t node_count);
[[nodiscard]] const CellKind* find_gmsh_cell(int gmsh_type);
[[nodiscard]] const CellKind& cell_kind(ElementType type);
/// 1 of a point, 2 of an edge.
[[nodiscard]] std::size_t corner_count(const CellKind& kind);
/// Also of edges with three nodes.
[[nodiscard]] bool is_second_order(const CellKind& kind);

}  // namespace meshsmooth::formats
