#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "surface/boundary_mesh.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth::detail {

/// The edges of a mesh's boundary that are to lie on the curves of a surface.
struct CurvePaths {
  std::vector<std::int32_t> corner_of;            // by node: the number of its corner, or -1
  std::vector<std::int32_t> curve_of;             // by node inside a path: its curve, or -1
  std::vector<std::array<std::int32_t, 2>> next;  // by node inside a path: the nodes beside it
  std::vector<std::uint8_t> on_path;              // by edge
  /// Edges of the surface's creases of less than 60 degrees that the boundary has no edges along:
  /// of a surface of few triangles they are bends of a curved patch rather than features.
  std::vector<std::array<std::int32_t, 2>> bends;
  std::int64_t unmatched_corners = 0;
  std::int64_t unmatched_curves = 0;
};

/// Gives each corner of the surface a node, and each curve a path of edges between those of its
/// ends that runs along the boundary's own creases and near the curve; no node is in two paths.
/// O((nodes + corners + curves) log nodes), with a large factor where curves have no path: their
/// searches end after some steps for each edge that a path would have, and all together after some
/// for each node. Curves that are left then are unmatched.
///
/// takes  `check`, called between parts of the work; what it throws ends it
[[nodiscard]] CurvePaths find_curve_paths(const BoundaryMesh& boundary, const SurfaceTrees& surface,
                                          const std::function<void()>& check);

}  // namespace meshsmooth::detail
