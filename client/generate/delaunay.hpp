#pragma once

#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// Delaunay tetrahedra of the points (TetGen), positive in VTK's node order.
/// No point is added or left out. Throws `NotSupported` in a build without
/// TetGen.
[[nodiscard]] std::vector<NodeId> delaunay_tetrahedra(const std::vector<Vec3d>& points);

}  // namespace meshsmooth::formats
