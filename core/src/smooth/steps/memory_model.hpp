#pragma once

#include <algorithm>

#include "meshsmooth/smoother.hpp"
#include "smooth/rules/sliding_constraints.hpp"
#include "smooth/steps/form.hpp"

namespace meshsmooth::detail {

/// What the memory models ask of a mesh.
struct MeshCounts {
  std::int64_t nodes = 0;
  std::int64_t elements = 0;
  std::int64_t entries = 0;  // of the connectivity
  std::int64_t edges = 0;    // an upper bound for ordinary meshes
  std::int64_t surface = 0;  // nodes of the boundary and between regions, the same
  int dimension = 3;
  int types = 0;
};

/// The edges are not known before the mesh is: Euler's formula gives those of a
/// conforming mesh but for its boundary facets, for which a share is added.
[[nodiscard]] inline MeshCounts count_mesh(const MeshSize& size) {
  MeshCounts counts{.nodes = size.node_count};
  double half_edges = 0;  // edges = nodes + sum of this
  std::int64_t edge_bound = 0;
  for (const ElementType type : kElementTypes) {
    const ElementShape& shape = element_shape(type);
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    if (count == 0) continue;
    ++counts.types;
    counts.dimension = shape.dimension;
    counts.elements += count;
    counts.entries += count * shape.node_count;
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

/// Entries of all rings; more in a mesh that is not conforming.
[[nodiscard]] inline std::size_t ring_entry_estimate(const MeshSize& size) {
  return static_cast<std::size_t>(2 * count_mesh(size).edges);
}

/// Bytes that `constrain` keeps.
[[nodiscard]] inline std::int64_t constraint_bytes(const MeshCounts& mesh,
                                                   const SmoothOptions& options) {
  if (options.boundary != BoundaryPolicy::slide) return 0;
  // To a node belong two triangles, and with them six places in rows, one quad or one edge.
  const bool hexahedra = mesh.entries == 8 * mesh.elements;
  const std::int64_t facets = mesh.dimension == 3 && !hexahedra ? 2 : 1;
  // What lies across its edges is kept where parts are curved.
  const auto facet = static_cast<std::int64_t>(sizeof(ConstrainedFacet) + 4 * sizeof(ElementId));
  const auto constraint = static_cast<std::int64_t>(sizeof(NodeConstraint));
  return mesh.nodes * 4 + mesh.surface * (facets * (facet + 3 * 4) + constraint + 8);
}

/// Bytes that the sweeps of `iterate` hold beside rings and balls.
[[nodiscard]] inline std::int64_t sweep_bytes(const MeshCounts& mesh, bool float64,
                                              const SmoothOptions& options) {
  const std::int64_t n = mesh.nodes;
  const std::int64_t position = float64 ? 24 : 12;
  const Form form = resolve_form(options);
  const bool active = acceptance_of(options).active();
  const bool in_place = form == Form::gauss_seidel || (form == Form::asynchronous && !active);
  std::int64_t bytes = in_place ? 0 : n * position;
  if (active && !in_place) bytes += n * (acceptance_of(options).smart ? 11 : 3);
  if (std::holds_alternative<Taubin>(options.method)) bytes += n * position;
  if (std::holds_alternative<HcLaplacian>(options.method)) bytes += 2 * n * position;
  if (options.movement_limit) bytes += n * position;
  if (std::holds_alternative<Optimize>(options.method)) {
    bytes += n;  // states
    const bool tetrahedra =
        mesh.types == 1 && mesh.dimension == 3 && mesh.entries == 4 * mesh.elements;
    if (tetrahedra) bytes += 3 * 4 * mesh.entries;  // opposite nodes
    // Of a tangled mesh what was given, and `limit_moves`.
    if (options.tangled == TangledPolicy::repair) bytes += n * (position + 3);
  }
  return bytes;
}

/// Bytes that the CPU backend keeps of a prepared topology.
[[nodiscard]] inline std::int64_t prepared_bytes(const MeshSize& size) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t numbers = mesh.nodes * (4 + 1) + mesh.entries * 4 + mesh.elements * 4;
  const std::int64_t balls = (mesh.nodes + 1) * 8 + mesh.entries * 4;
  const std::int64_t rings = (mesh.nodes + 1) * 8 + mesh.edges * 2 * 4;
  const auto table = static_cast<std::int64_t>(kElementTypeCount * sizeof(ElementShape));
  const std::int64_t bytes = numbers + balls + rings + table;
  return bytes + bytes / 50;
}

/// Bytes of the host buffers that the CPU backend holds at its highest point, from
/// the sizes alone.
[[nodiscard]] inline std::int64_t estimate_bytes(const MeshSize& size, const SmoothOptions& options,
                                                 int thread_count) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const std::int64_t position = size.float64 ? 24 : 12;
  const std::int64_t kept = n * position         // positions
                            + n * 4              // caller's node of a node
                            + mesh.entries * 4   // connectivity
                            + mesh.elements * 4  // caller's element of an element
                            + constraint_bytes(mesh, options);
  const std::int64_t balls = (n + 1) * 8 + mesh.entries * 4;
  const std::int64_t rings = (n + 1) * 8 + mesh.edges * 2 * 4;
  const std::int64_t renumbering = n * 4 + (n + 1) * 8 + n * 4 + mesh.elements * 4;
  std::int64_t iterating = n + sweep_bytes(mesh, size.float64, options);
  // Normals of a curved surface; a plane one does without.
  if (mesh.dimension == 2) {
    iterating += mesh.elements * static_cast<std::int64_t>(sizeof(PackedDirection));
  }
  const std::int64_t colouring = resolve_form(options) == Form::gauss_seidel ? n * 12 : 0;
  const std::int64_t constraining = options.boundary == BoundaryPolicy::slide ? n * 8 : 0;
  const std::int64_t held_balls = needs_balls(options) ? balls : 0;
  const std::int64_t peak =
      kept + std::max({renumbering, balls + rings + mesh.edges * 2 * 4,
                       balls + rings + n + colouring, balls + rings + n + constraining,
                       held_balls + rings + iterating + (colouring > 0 ? n * 4 : 0)});
  // The judge counts its histograms per thread.
  const std::int64_t tallies = (1 + thread_count) * (std::int64_t{192} << 10);
  return peak + peak / 50 + tallies;
}

}  // namespace meshsmooth::detail
