#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "meshsmooth/element.hpp"

namespace meshsmooth::formats {

/// A linear cell as the libraries call it. `gmsh_nodes[i]` is the place in
/// Gmsh's node order of VTK's node i; only the wedge differs.
struct CellKind {
  std::string_view name;
  int vtk_type;
  int gmsh_type;
  int dimension;
  int node_count;
  std::optional<ElementType> element;  // none for points and edges
  std::array<std::int8_t, 8> gmsh_nodes;
};

/// Null for a type that cannot travel (higher order, polyhedra …).
[[nodiscard]] const CellKind* find_vtk_cell(int vtk_type, std::size_t node_count);
/// Of a cell that may be a lower-dimensional cell or part of a mesh; none: it may be neither.
[[nodiscard]] std::optional<int> cell_dimension(int vtk_type, std::size_t node_count);
[[nodiscard]] const CellKind* find_gmsh_cell(int gmsh_type);
[[nodiscard]] const CellKind& cell_kind(ElementType type);

}  // namespace meshsmooth::formats
