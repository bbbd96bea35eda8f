#pragma once

#include <vtkPointSet.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dataset.hpp"

namespace meshsmooth::formats {

// Cells of images, whose nodes go along x, then y, then z: quads and hexahedra but for the order.
// They are parallel to the axes by definition, so that one whose nodes move is one no more.
inline constexpr int kPixelCell = 8;
inline constexpr int kVoxelCell = 11;

[[nodiscard]] constexpr bool is_voxel(int type, std::size_t node_count) {
  return (type == kPixelCell && node_count == 4) || (type == kVoxelCell && node_count == 8);
}

/// The type of the same cell as a quad or hexahedron, whose order of nodes it takes on.
template <class Id>
[[nodiscard]] int turn_voxel(std::span<Id> nodes) {
  std::swap(nodes[2], nodes[3]);
  if (nodes.size() == 4) return kQuadCell;
  std::swap(nodes[6], nodes[7]);
  return kHexahedronCell;
}

class VtkDataset;

/// The pixels and voxels of which a node has moved, ascending; or all. O(cells).
[[nodiscard]] std::vector<std::int64_t> voxels_to_turn(const VtkDataset& dataset, const Mesh& mesh,
                                                       bool all = false);

/// Makes quads and hexahedra of these cells of a grid, whose lists may be shared with others.
/// O(cells).
void turn_voxels(vtkPointSet& dataset, const std::vector<std::int64_t>& turned);

}  // namespace meshsmooth::formats
