#pragma once

#include <algorithm>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/cpu/cpu_executor.hpp"

namespace meshsmooth::detail {

/// Bytes of `JobElements`, and what `renumber_elements` holds while it runs.
[[nodiscard]] inline std::int64_t element_bytes(const MeshCounts& mesh) {
  return mesh.entries * 4 + mesh.elements * 4;
}
[[nodiscard]] inline std::int64_t renumbering_bytes(const MeshCounts& mesh) {
  return mesh.nodes * 4 + row_bytes(mesh.nodes, mesh.elements);
}

/// The caller's elements of one type, wherever their blocks are.
class SourceElements {
 public:
  SourceElements(const TopologyView& topology, ElementType type) : width_(element_width(type)) {
    std::size_t first_caller = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const std::size_t elements = block.element_count();
      if (block.type == type && elements > 0) {
        blocks_.push_back({block.nodes.data(), count_, first_caller});
        count_ += elements;
      }
      first_caller += elements;
    }
  }

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] std::span<const NodeId> nodes(std::size_t item) const {
    const Block& block = block_of(item);
    return {block.nodes + (item - block.first) * width_, width_};
  }
  [[nodiscard]] ElementId caller_id(std::size_t item) const {
    const Block& block = block_of(item);
    return static_cast<ElementId>(block.first_caller + (item - block.first));
  }

 private:
  struct Block {
    const NodeId* nodes;
    std::size_t first;         // among the elements of the type
    std::size_t first_caller;  // the caller's id of its first element
  };

  [[nodiscard]] const Block& block_of(std::size_t item) const {
    const auto after = std::ranges::upper_bound(blocks_, item, {}, &Block::first);
    return *std::prev(after);
  }

  std::size_t width_;
  std::size_t count_ = 0;
  std::vector<Block> blocks_;
};

/// cost   O(elements); `renumbering_bytes` while it runs
inline JobElements<CpuExecutor> renumber_elements(CpuExecutor& executor,
                                                  const TopologyView& topology,
                                                  const NodeId* internal_of) {
  std::size_t connectivity_size = 0;
  for (const ElementBlockView& block : topology.blocks) connectivity_size += block.nodes.size();
  JobElements<CpuExecutor> result;
  result.dimension = element_shape(topology.blocks.front().type).dimension;
  result.connectivity = executor.allocate<NodeId>(connectivity_size);
  result.caller_ids = executor.allocate<ElementId>(topology.element_count());

  NodeId* next_nodes = result.connectivity.data();
  for (const ElementType type : kLinearTypes) {
    const SourceElements items(topology, type);
    if (items.size() == 0) continue;
    const auto visit_lowest_node = [&items, internal_of](std::size_t item, const auto& emit) {
      NodeId lowest = std::numeric_limits<NodeId>::max();
      for (const NodeId node : items.nodes(item)) lowest = std::min(lowest, internal_of[node]);
      emit(lowest);
    };
    const auto by_lowest_node = group_items(executor, topology.node_count, items.size(),
                                            visit_lowest_node, [](ElementId item) { return item; });
    const ElementId* const order = by_lowest_node.entries.data();
    ElementId* const caller_ids = result.caller_ids.data() + result.view.count;
    const auto width = element_width(type);
    executor.for_each(items.size(), [&](std::size_t element) {
      caller_ids[element] = items.caller_id(order[element]);
      NodeId* to = next_nodes + element * width;
      for (const NodeId node : items.nodes(order[element])) *to++ = internal_of[node];
    });
    result.view.runs[result.view.run_count++] = {&element_shape(type), next_nodes,
                                                 result.view.count};
    result.view.count += items.size();
    next_nodes += items.size() * width;
    result.view.tetrahedra = result.view.run_count == 1 && type == ElementType::tetrahedron;
  }
  return result;
}

}  // namespace meshsmooth::detail
