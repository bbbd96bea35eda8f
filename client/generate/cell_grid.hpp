#pragma once

#include <array>

#include "generate/cuts.hpp"

namespace meshsmooth::formats {

/// A grid of cells, numbered along x, then y, then z.
struct CellGrid {
  int x, y, z;

  [[nodiscard]] NodeId node(int i, int j, int k) const { return (k * (y + 1) + j) * (x + 1) + i; }
  [[nodiscard]] std::size_t node_count() const {
    return static_cast<std::size_t>(x + 1) * static_cast<std::size_t>(y + 1) *
           static_cast<std::size_t>(z + 1);
  }
  /// In VTK's order of a hexahedron.
  [[nodiscard]] std::array<NodeId, 8> corners(int i, int j, int k) const {
    return {
        node(i, j, k),     node(i + 1, j, k),     node(i + 1, j + 1, k),     node(i, j + 1, k),
        node(i, j, k + 1), node(i + 1, j, k + 1), node(i + 1, j + 1, k + 1), node(i, j + 1, k + 1)};
  }

  /// Calls `visit(i, j, k)` for every node, in the order of the numbers.
  template <class Visit>
  void for_each_node(Visit visit) const {
    for (int k = 0; k <= z; ++k) {
      for (int j = 0; j <= y; ++j) {
        for (int i = 0; i <= x; ++i) visit(i, j, k);
      }
    }
  }
  template <class Visit>
  void for_each_cell(Visit visit) const {
    for (int k = 0; k < z; ++k) {
      for (int j = 0; j < y; ++j) {
        for (int i = 0; i < x; ++i) visit(i, j, k);
      }
    }
  }

  /// Six tetrahedra per cell.
  [[nodiscard]] ElementBlock kuhn_tetrahedra() const {
    ElementBlock block{ElementType::tetrahedron, {}};
    for_each_cell([&](int i, int j, int k) { add_kuhn_tetrahedra(block.nodes, corners(i, j, k)); });
    return block;
  }
};

}  // namespace meshsmooth::formats
