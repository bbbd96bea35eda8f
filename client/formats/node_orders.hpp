#pragma once

#include <cstdint>
#include <span>

#include "cells.hpp"

namespace meshsmooth::formats {

/// The order in which a format lists a cell's nodes. The formats differ in the side from which the
/// first face of a wedge (of all cells but the wedge: MED) is seen, and in the sequence of the
/// nodes on edges and faces. Exodus and CGNS differ in hexahedron27 only.
enum class NodeOrder {
  vtk,  // the house's, also of XDMF
  gmsh,
  abaqus,
  exodus,
  cgns,
  med,
  tetgen,
  unv,      // nodes on edges stand between their corners
  mirrored  // of no format: the cell seen in a mirror
};

/// @returns by node in VTK's order its place in the other one. O(1), thread-safe.
[[nodiscard]] std::span<const std::int8_t> places_in(NodeOrder order, const CellKind& kind);

}  // namespace meshsmooth::formats
