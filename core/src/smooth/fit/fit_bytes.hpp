#pragma once

#include "meshsmooth/target_surface.hpp"
#include "smooth/base/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Upper bound of what a job with a target surface holds besides in executor memory: a copy of the
/// surface, two arrays of positions.
[[nodiscard]] inline std::int64_t fit_bytes(const MeshSize& size) {
  const std::int64_t points = size.surface_points, triangles = size.surface_triangles;
  if (triangles == 0) return 0;
  const MeshCounts mesh = count_mesh(size);
  // Of each triangle two items and those of its edges, each with a box: `SurfaceTrees`.
  return points * 28 + triangles * 256 + mesh.nodes * 2 * mesh.position_bytes;
}

/// Upper bound of what it holds on the host, whatever the executor: the surface, the boundary's
/// graph, its nodes.
[[nodiscard]] inline std::int64_t fit_host_bytes(const MeshSize& size) {
  const std::int64_t points = size.surface_points, triangles = size.surface_triangles;
  if (triangles == 0) return 0;
  const MeshCounts mesh = count_mesh(size);
  constexpr std::int64_t kNode = 700;  // facets, edges and their order, costs, trees of the facets
  return TargetSurface::estimate_bytes(points, triangles) + mesh.nodes * 40 + mesh.surface * kNode;
}

}  // namespace meshsmooth::detail
