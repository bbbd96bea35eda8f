#pragma once

#include <algorithm>
#include <atomic>
#include <vector>

#include "smooth/boundary.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/neighbours.hpp"

namespace meshsmooth::detail {

/// A set of node ids that is emptied in O(1) and grows with its row.
class RowSet {
 public:
  void clear(std::size_t capacity) {
    if (slots_.size() < 2 * capacity) {
      std::size_t size = 128;
      while (size < 2 * capacity) size *= 2;
      slots_.assign(size, {0, 0});
      epoch_ = 0;
    }
    if (++epoch_ == 0) {
      std::fill(slots_.begin(), slots_.end(), Slot{0, 0});
      epoch_ = 1;
    }
    row_.clear();
  }

  void insert(NodeId node) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = static_cast<std::uint32_t>(node) * 2654435769U & mask;;
         at = (at + 1) & mask) {
      Slot& slot = slots_[at];
      if (slot.epoch != epoch_) {
        slot = {epoch_, node};
        row_.push_back(node);
        return;
      }
      if (slot.node == node) return;
    }
  }

  [[nodiscard]] std::vector<NodeId>& row() { return row_; }

 private:
  struct Slot {
    std::uint32_t epoch;
    NodeId node;
  };
  std::vector<Slot> slots_;
  std::vector<NodeId> row_;
  std::uint32_t epoch_ = 0;
};

/// `find_rings_by_sorting` from the balls: per node the union of its elements'
/// edges. Two walks, one to count and one to fill, so that nothing is allocated
/// beyond the answer. O(ball entries * nodes per element).
inline RowBuffer<CpuExecutor, NodeId> find_rings(CpuExecutor& executor, std::size_t node_count,
                                                 const Elements& elements,
                                                 const Rows<ElementId>& balls,
                                                 const NodeId* caller_ids) {
  RowBuffer<CpuExecutor, NodeId> rings;
  rings.offsets = executor.allocate<std::int64_t>(node_count + 1);
  std::int64_t* const offsets = rings.offsets.data();
  const auto collect = [&](RowSet& set, std::size_t node) {
    set.clear(balls.size(node) * 6);
    for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
      visit_neighbours(elements[*e], static_cast<NodeId>(node), [&](NodeId n) { set.insert(n); });
    }
  };
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    thread_local RowSet set;
    for (std::size_t node = begin; node < end; ++node) {
      collect(set, node);
      offsets[node] = static_cast<std::int64_t>(set.row().size());
    }
  });
  offsets[node_count] = 0;
  const std::int64_t count = executor.exclusive_scan(offsets, node_count + 1);
  rings.entries = executor.allocate<NodeId>(static_cast<std::size_t>(count));
  NodeId* const entries = rings.entries.data();
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    thread_local RowSet set;
    for (std::size_t node = begin; node < end; ++node) {
      collect(set, node);
      NodeId* const row = entries + offsets[node];
      std::copy(set.row().begin(), set.row().end(), row);
      sort_row(row, set.row().size(), [=](NodeId n) { return caller_ids[n]; });
    }
  });
  return rings;
}

/// `find_boundary_by_sorting` from the balls: each facet is counted in the ball
/// of its lowest node. Exact, no hashing. O(ball entries * log ball).
inline void find_boundary(CpuExecutor& executor, std::size_t node_count, const Elements& elements,
                          const Rows<ElementId>& balls, const NodeId* caller_nodes,
                          const ElementId* caller_elements, std::uint8_t* on_boundary) {
  std::fill(on_boundary, on_boundary + node_count, std::uint8_t{0});
  std::atomic<bool> overused = false;
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    thread_local std::vector<FacetKey> facets;
    for (std::size_t node = begin; node < end; ++node) {
      facets.clear();
      for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
        const ElementView element = elements[*e];
        for (int f = 0; f < element.shape->facet_count; ++f) {
          const FacetShape& facet = element.shape->facets[f];
          bool lowest_here = false;
          bool lower = false;
          for (int n = 0; n < facet.node_count; ++n) {
            const NodeId other = element.nodes[facet.nodes[n]];
            lowest_here |= other == static_cast<NodeId>(node);
            lower |= other < static_cast<NodeId>(node);
          }
          if (lowest_here && !lower) facets.push_back(facet_key(element, f));
        }
      }
      std::sort(facets.begin(), facets.end());
      for (std::size_t first = 0, last; first < facets.size(); first = last) {
        for (last = first; last < facets.size() && facets[last] == facets[first];) ++last;
        if (last - first > 2) overused.store(true, std::memory_order_relaxed);
        if (last - first != 1) continue;
        for (const NodeId n : facets[first].nodes) {
          if (n >= 0) CpuExecutor::store(on_boundary[n], std::uint8_t{1});
        }
      }
    }
  });
  if (overused) throw_overused_facet(elements, caller_nodes, caller_elements);
}

}  // namespace meshsmooth::detail
