#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::cli {

/// Triangles to draw: of the facets that one element alone has, or of all surface elements.
struct Surface {
  struct Triangle {
    std::array<std::uint32_t, 3> corners;  // indices into `nodes`
    std::uint32_t element;                 // the caller's id
    std::uint8_t edges;  // bit i: the side from corner i to the next is an edge of the mesh
  };
  std::vector<NodeId> nodes = {};
  std::vector<Triangle> triangles = {};
  std::size_t whole_count = 0;  // of triangles before `simplify`
};

/// The topology must be valid. O(elements), 8 B a facet.
[[nodiscard]] Surface find_surface(const TopologyView& topology);

/// Merges the nodes in each cell of a grid and drops what has no area left. The sides of what
/// remains are no edges of the mesh any more.
/// @param positions of `surface.nodes`
/// @param cells along the longest side of their bounding box
[[nodiscard]] Surface simplify(const Surface& surface, std::span<const Vec3d> positions, int cells);

}  // namespace meshsmooth::cli
