#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dataset.hpp"
#include "foam_reader.hpp"

namespace meshsmooth::formats {

/// A face of a cell; its nodes are counter-clockwise seen from outside, unless it is turned.
struct FoamCellFace {
  std::int64_t face;
  bool turned;  // the cell is its neighbour, not its owner
};

/// The cell that these faces enclose: a hexahedron, wedge, pyramid or tetrahedron in VTK's node
/// order where they are the faces of one, else a polyhedron with its nodes, each once, ascending.
void recognize_cell(const FoamFaces& faces, std::span<const FoamCellFace> of_cell, Cell& cell);

}  // namespace meshsmooth::formats
