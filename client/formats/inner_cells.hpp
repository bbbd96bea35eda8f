#pragma once

#include <string>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// What the file names inside the mesh: its lower-dimensional cells (surfaces, lines and points)
/// and its sets of faces, where they are neither on the boundary nor between two of
/// `Mesh::regions`.
struct InnerCells {
  std::vector<NodeId> nodes;       // ascending; those of the mesh's elements that are not fixed yet
  std::vector<std::string> names;  // of their groups and sets, where they have any
};

/// A surface is inside where two elements of one region share each of its cells, a line or point
/// where one of its nodes is. A set of faces is taken as a whole. O(cells + facets of elements near
/// them * log cells).
[[nodiscard]] InnerCells find_inner_cells(const MeshFile& file);

}  // namespace meshsmooth::formats
