#pragma once

#include "meshsmooth/target_surface.hpp"
#include "smooth/base/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Upper bound of what a job with a target surface holds besides: a copy of the surface, the
/// boundary's graph on the host, two arrays of positions.
[[nodiscard]] inline std::int64_t fit_bytes(const MeshSize& size) {
  const std::int64_t points = size.surface_points, triangles = size.surface_triangles;
  if (triangles == 0) return 0;
  const MeshCounts mesh = count_mesh(size);
  constexpr std::int64_t kNode = 700;  // facets, edges and their order, costs, trees of the facets
  return TargetSurface::estimate_bytes(points, triangles) +
         mesh.nodes * (2 * mesh.position_bytes + 40) + mesh.surface * kNode;
}

}  // namespace meshsmooth::detail
