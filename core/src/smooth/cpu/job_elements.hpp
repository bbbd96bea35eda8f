#pragma once

#include <vector>

#include "meshsmooth/mesh.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/steps/job_mesh.hpp"
#include "smooth/steps/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Bytes of `JobElements` without the table, and what `renumber_elements` holds while it runs.
[[nodiscard]] inline std::int64_t element_bytes(const MeshCounts& mesh) {
  return mesh.entries * 4 + mesh.elements * 4;
}
[[nodiscard]] inline std::int64_t renumbering_bytes(const MeshCounts& mesh) {
  return mesh.nodes * 4 + row_bytes(mesh.nodes, mesh.elements);
}

/// The caller's elements of one type: blocks in executor memory.
struct SourceBlock {
  const NodeId* nodes;
  std::size_t first;         // among the elements of the type
  std::size_t first_caller;  // the caller's id of its first element
};

/// The caller's elements of one type, wherever their blocks lie.
struct SourceElements {
  const SourceBlock* blocks;
  std::size_t block_count;
  int node_count;  // of an element

  [[nodiscard]] const SourceBlock& block_of(std::size_t item) const {
    std::size_t low = 0;
    for (std::size_t high = block_count; high - low > 1;) {
      const std::size_t middle = low + (high - low) / 2;
      (blocks[middle].first <= item ? low : high) = middle;
    }
    return blocks[low];
  }
  [[nodiscard]] const NodeId* nodes(std::size_t item) const {
    const SourceBlock& block = block_of(item);
    return block.nodes + (item - block.first) * static_cast<std::size_t>(node_count);
  }
  [[nodiscard]] ElementId caller_id(std::size_t item) const {
    const SourceBlock& block = block_of(item);
    return static_cast<ElementId>(block.first_caller + (item - block.first));
  }
};

/// Emits the lowest internal number among an element's nodes.
struct VisitLowestNode {
  SourceElements elements;
  const NodeId* internal_of;

  template <class Emit>
  void operator()(std::size_t item, const Emit& emit) const {
    const NodeId* const nodes = elements.nodes(item);
    NodeId lowest = internal_of[nodes[0]];
    for (int n = 1; n < elements.node_count; ++n) {
      if (internal_of[nodes[n]] < lowest) lowest = internal_of[nodes[n]];
    }
    emit(lowest);
  }
};

/// cost   O(elements); 8 B an element and 8 B a node while it runs
inline JobElements<CpuExecutor> renumber_elements(CpuExecutor& executor,
                                                  const TopologyView& topology,
                                                  const NodeId* internal_of) {
  const std::size_t node_count = topology.node_count;
  JobElements<CpuExecutor> result;
  result.dimension = element_shape(topology.blocks.front().type).dimension;
  result.shapes = executor.allocate<ElementShape>(kElementTypeCount);
  executor.upload(element_table().data(), kElementTypeCount, result.shapes.data());

  std::size_t connectivity_size = 0;
  for (const ElementBlockView& block : topology.blocks) connectivity_size += block.nodes.size();
  result.connectivity = executor.allocate<NodeId>(connectivity_size);
  result.caller_ids = executor.allocate<ElementId>(topology.element_count());

  NodeId* next_nodes = result.connectivity.data();
  for (const ElementType type : kElementTypes) {
    std::vector<SourceBlock> blocks;
    std::vector<CpuExecutor::HostArray<NodeId>> arrays;
    std::size_t count = 0;
    std::size_t first_caller = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const std::size_t elements = block.element_count();
      if (block.type == type && elements > 0) {
        arrays.push_back(executor.in_executor_memory(block.nodes));
        blocks.push_back({arrays.back().data(), count, first_caller});
        count += elements;
      }
      first_caller += elements;
    }
    if (count == 0) continue;

    auto block_buffer = executor.allocate<SourceBlock>(blocks.size());
    executor.upload(blocks.data(), blocks.size(), block_buffer.data());
    const ElementShape* const shape = &element_shape(type);
    const SourceElements items{block_buffer.data(), blocks.size(), shape->node_count};
    const auto by_lowest_node =
        group_items(executor, node_count, count, VisitLowestNode{items, internal_of},
                    [](ElementId item) { return item; });

    const std::size_t first = result.view.count;
    const ElementId* const order = by_lowest_node.entries.data();
    NodeId* const nodes_out = next_nodes;
    ElementId* const caller_ids = result.caller_ids.data() + first;
    executor.for_each(count, [=](std::size_t element) {
      const ElementId item = order[element];
      const NodeId* const nodes = items.nodes(item);
      caller_ids[element] = items.caller_id(item);
      const auto width = static_cast<std::size_t>(items.node_count);
      for (std::size_t n = 0; n < width; ++n) {
        nodes_out[element * width + n] = internal_of[nodes[n]];
      }
    });
    result.view.runs[result.view.run_count++] = {
        result.shapes.data() + static_cast<std::size_t>(type), nodes_out, first};
    result.view.count += count;
    next_nodes += count * static_cast<std::size_t>(shape->node_count);
  }
  return result;
}

}  // namespace meshsmooth::detail
