#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "surface/boundary_mesh.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth::detail {

/// Where the nodes of a boundary belong on a surface.
struct Assignment {
  std::vector<std::int32_t> entities;             // by node, as `SurfaceView` numbers them
  std::vector<std::array<std::int32_t, 2>> next;  // of nodes on curves: those beside them
  std::int64_t unmatched_corners = 0;
  std::int64_t unmatched_curves = 0;
  std::vector<std::array<std::int32_t, 2>> bends;  // see `CurvePaths`
};

/// Assigns each node to a corner, a curve or a patch: corners and curves as `find_curve_paths`,
/// then the parts between the paths to the patches that most of their facets are near, by area. A
/// node much farther from that patch than from another goes to the nearest one: where paths are
/// missing, parts have several patches.
///
/// takes  `check`, called between parts of the work; what it throws ends it
[[nodiscard]] Assignment assign(const BoundaryMesh& boundary, const SurfaceTrees& surface,
                                const std::function<void()>& check);

}  // namespace meshsmooth::detail
