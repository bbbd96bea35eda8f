#pragma once

#include <algorithm>
#include <vector>

#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/rows.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/cpu/row_counter.hpp"

namespace meshsmooth::detail {

/// Bytes of all balls, and of all rings.
[[nodiscard]] inline std::int64_t ball_bytes(const MeshCounts& mesh) {
  return row_bytes(mesh.nodes, mesh.entries);
}
[[nodiscard]] inline std::int64_t ring_bytes(const MeshCounts& mesh) {
  return row_bytes(mesh.nodes, 2 * mesh.edges);
}
/// Bytes that `find_rings` holds besides them: the entries once more, in chunks.
[[nodiscard]] inline std::int64_t finding_rings_bytes(const MeshCounts& mesh) {
  return 2 * mesh.edges * 4;
}

/// The balls: per node the elements around it.
///
/// takes  the elements; `caller_ids` maps them to the caller's element ids
/// gives  rows ascending by the caller's element id
/// cost   O(elements), as group_items with nodes-per-element entries each
inline RowBuffer<CpuExecutor, ElementId> find_balls(CpuExecutor& executor, std::size_t node_count,
                                                    const Elements& elements,
                                                    const ElementId* caller_ids) {
  const auto visit_nodes = [=](std::size_t element, const auto& emit) {
    const ElementView view = elements[element];
    for (int n = 0; n < view.shape->node_count; ++n) emit(view.nodes[n]);
  };
  return group_items(executor, node_count, elements.count, visit_nodes,
                     [=](ElementId element) { return caller_ids[element]; });
}

/// Calls `emit(neighbour)` for every local edge of the element at `node`.
template <class Emit>
inline void visit_neighbours(const ElementView& element, NodeId node, const Emit& emit) {
  const ElementShape& shape = *element.shape;
  if (is_simplex(shape)) {
    for (int n = 0; n < shape.node_count; ++n) {
      if (element.nodes[n] != node) emit(element.nodes[n]);
    }
    return;
  }
  for (int e = 0; e < shape.edge_count; ++e) {
    const NodeId a = element.nodes[shape.edges[e][0]];
    const NodeId b = element.nodes[shape.edges[e][1]];
    if (a == node) emit(b);
    if (b == node) emit(a);
  }
}

/// The rings: per node the union of its elements' edges.
///
/// gives  per node its neighbours along edges, ascending by the caller's id
/// cost   O(ball entries * nodes per element); the entries exist twice while the rows are
///        assembled
inline RowBuffer<CpuExecutor, NodeId> find_rings(CpuExecutor& executor, std::size_t node_count,
                                                 const Elements& elements,
                                                 const Rows<ElementId>& balls,
                                                 const NodeId* caller_ids) {
  RowBuffer<CpuExecutor, NodeId> rings;
  rings.offsets = executor.allocate<std::int64_t>(node_count + 1);
  std::int64_t* const offsets = rings.offsets.data();
  std::vector<CpuBuffer<NodeId>> chunks(executor.chunk_count(node_count));
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    RowCounter<NodeId> row;
    std::vector<NodeId> chunk;
    for (std::size_t node = begin; node < end; ++node) {
      row.clear(balls.size(node) * kMaxNodeEdges);
      for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
        visit_neighbours(elements[*e], static_cast<NodeId>(node), [&](NodeId n) { row.add(n); });
      }
      for (std::size_t n = 0; n < row.size(); ++n) chunk.push_back(row[n].key);
      sort_row(chunk.data() + (chunk.size() - row.size()), row.size(),
               [=](NodeId n) { return caller_ids[n]; });
      offsets[node] = static_cast<std::int64_t>(row.size());
    }
    CpuBuffer<NodeId>& kept = chunks[executor.chunk_of(begin)];
    kept = executor.allocate<NodeId>(chunk.size());
    std::copy(chunk.begin(), chunk.end(), kept.data());
  });
  offsets[node_count] = 0;
  const auto count = static_cast<std::size_t>(executor.exclusive_scan(offsets, node_count + 1));
  rings.entries = executor.allocate<NodeId>(count);
  NodeId* const entries = rings.entries.data();
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t) {
    CpuBuffer<NodeId>& chunk = chunks[executor.chunk_of(begin)];
    std::copy(chunk.data(), chunk.data() + chunk.size(), entries + offsets[begin]);
    chunk = {};
  });
  return rings;
}

}  // namespace meshsmooth::detail
