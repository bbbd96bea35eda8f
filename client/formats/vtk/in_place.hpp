#pragma once

#include <string>

#include "content.hpp"
#include "vtk/layout.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {

/// Whether the layout has the points that VTK has read, and the voxels where there are some: then
/// the file can be written by replacing their numbers. O(nodes).
[[nodiscard]] bool agrees(std::string_view file, const VtkLayout& layout,
                          const VtkDataset& dataset);

/// The file with the positions of the mesh put in place; all else stays as it is, byte for byte.
/// Voxels of which a node has moved become hexahedra. Points become float32 or float64 where the
/// mesh has another precision than the file, or they were integers. The layout must agree.
[[nodiscard]] std::string moved_file(std::string_view file, const VtkDataset& dataset,
                                     const Mesh& mesh);

}  // namespace meshsmooth::formats
