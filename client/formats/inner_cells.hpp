#pragma once

#include <string>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// What the file names inside the mesh: its lower-dimensional cells (surfaces, lines and points)
/// and the facets of its sets, where they are neither on the boundary nor between two of
/// `Mesh::regions`.
struct InnerCells {
  std::vector<NodeId> nodes;       // ascending; those of the mesh's elements that are not fixed yet
  std::vector<std::string> names;  // of their groups and sets, where they have any
};

/// Whether the file has sets of sides, which are not among its lower-dimensional cells. O(sets).
[[nodiscard]] bool names_facets(const MeshFile& file);

/// A facet of the elements is inside where two of one region share it, a line or point between
/// volume elements or a point of a surface where it is not on the boundary. O(cells + facets of
/// sets + facets of elements near them * log of both).
[[nodiscard]] InnerCells find_inner_cells(const MeshFile& file);

}  // namespace meshsmooth::formats
