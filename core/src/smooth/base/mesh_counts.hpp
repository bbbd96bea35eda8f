#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "meshsmooth/smoother.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// What the estimates of memory need to know of a mesh.
struct MeshCounts {
  std::int64_t nodes = 0;
  std::int64_t elements = 0;
  std::int64_t entries = 0;  // of the connectivity
  std::int64_t edges = 0;    // an upper bound for ordinary meshes
  std::int64_t boxes = 0;    // elements that are no simplices
  std::int64_t surface = 0;  // nodes of the boundary and between regions, the same
  std::int64_t position_bytes = 24;
  int dimension = 3;
  int types = 0;

  /// Whether all elements are of a volume type with this many nodes.
  [[nodiscard]] bool only(int node_count) const {
    return types == 1 && dimension == 3 && entries == node_count * elements;
  }
};

/// Bytes of rows of ids; see `Rows`.
[[nodiscard]] constexpr std::int64_t row_bytes(std::int64_t rows, std::int64_t entries) {
  return (rows + 1) * 8 + entries * 4;
}

/// Counts by sizes alone. The number of edges follows from Euler's formula for a conforming mesh,
/// except for its boundary facets, for which a share is added.
[[nodiscard]] inline MeshCounts count_mesh(const MeshSize& size) {
  MeshCounts counts{.nodes = size.node_count, .position_bytes = size.float64 ? 24 : 12};
  double half_edges = 0;  // edges = nodes + sum of this
  std::int64_t edge_bound = 0;
  for (const ElementType type : kLinearTypes) {
    const ElementShape& shape = element_shape(type);
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    if (count == 0) continue;
    ++counts.types;
    counts.dimension = shape.dimension;
    counts.elements += count;
    counts.entries += count * shape.node_count;
    if (!is_simplex(shape)) counts.boxes += count;
    edge_bound += count * shape.edge_count;
    half_edges +=
        static_cast<double>(count) * (shape.dimension == 3 ? shape.facet_count / 2.0 - 1.0 : 1.0);
  }
  const auto n = static_cast<double>(size.node_count);
  const double surface =
      counts.dimension == 3 ? 6.0 * std::pow(n, 2.0 / 3.0) * 1.5 : 4.0 * std::sqrt(n);
  counts.edges = std::min(edge_bound, static_cast<std::int64_t>(n + half_edges + surface));
  // A cube's boundary has 6 n^(2/3) nodes, a square's 4 n^(1/2).
  counts.surface = std::min(
      counts.nodes, static_cast<std::int64_t>(counts.dimension == 3 ? surface / 1.2 : surface));
  return counts;
}

[[nodiscard]] inline MeshSize size_of(const TopologyView& topology) {
  MeshSize size{.node_count = static_cast<std::int64_t>(topology.node_count),
                .regions = !topology.regions.empty()};
  for (const ElementBlockView& block : topology.blocks) {
    size.element_counts[static_cast<std::size_t>(block.type)] +=
        static_cast<std::int64_t>(block.element_count());
  }
  return size;
}

/// Bytes of the metrics of all elements that a job returns.
[[nodiscard]] inline std::int64_t element_quality_bytes(const MeshCounts& mesh,
                                                        const SmoothOptions& options) {
  return mesh.elements *
         static_cast<std::int64_t>(options.element_quality_metrics.size() * sizeof(float));
}

/// Entries of all rings; a mesh that is not conforming has more.
[[nodiscard]] inline std::size_t ring_entry_estimate(const MeshSize& size) {
  return static_cast<std::size_t>(2 * count_mesh(size).edges);
}

}  // namespace meshsmooth::detail
