#pragma once

#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::test {

/// What a server would be told of the mesh before its data.
inline MeshSize size_of(const Mesh& mesh, const JobInput& input = {}) {
  MeshSize size{.node_count = static_cast<std::int64_t>(mesh.node_count()),
                .element_counts = {},
                .float64 = mesh.positions.index() == 1,
                .regions = !mesh.regions.empty()};
  for (const ElementBlockView& block : mesh.block_views()) {
    size.element_counts[static_cast<std::size_t>(block.type)] +=
        static_cast<std::int64_t>(block.element_count());
  }
  if (input.surface != nullptr) {
    size.surface_points = static_cast<std::int64_t>(input.surface->points.size());
    size.surface_triangles = static_cast<std::int64_t>(input.surface->triangles.size());
  }
  return size;
}

}  // namespace meshsmooth::test
