#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/parallel.hpp"
#include "meshsmooth/mesh.hpp"

namespace meshsmooth::detail {

/// A facet as one of its elements has it.
struct FacetUse {
  std::array<NodeId, kMaxFacetNodes> corners;  // ascending; those of shorter ones begin by -1
  ElementType type;
  std::int8_t number;   // in the element
  std::size_t element;  // its id
  const NodeId* nodes;  // of the element
};

/// All facets of a valid topology by their lowest corner: what finds the elements that share one.
/// 8 B a facet of an element and 8 B a node. O(facets), multi-threaded.
class FacetRows {
 public:
  /// @param check  called between parts of the work; what it throws ends it
  explicit FacetRows(
      const TopologyView& topology, const std::function<void()>& check = [] {})
      : topology_(topology) {
    std::size_t first = 0;
    for (const ElementBlockView& block : topology.blocks) {
      first_elements_.push_back(first);
      first += block.element_count();
    }
    offsets_.resize(topology.node_count + 1);
    // Counted, then filled from the ends of the rows: a row's order is settled by `visit_row`.
    for_each_facet(check, [&](std::size_t lowest, std::uint64_t) {
      std::atomic_ref(offsets_[lowest]).fetch_add(1, std::memory_order_relaxed);
    });
    std::uint64_t end = 0;
    for (std::uint64_t& offset : offsets_) offset = end += offset;
    entries_.resize(end);
    for_each_facet(check, [&](std::size_t lowest, std::uint64_t entry) {
      const std::uint64_t place =
          std::atomic_ref(offsets_[lowest]).fetch_sub(1, std::memory_order_relaxed) - 1;
      entries_[place] = entry;
    });
  }

  /// Calls `visit(uses)` for each facet whose lowest corner is `node`: all its uses, by ascending
  /// element. The facets come in an order of their own. O(row log row).
  template <class Visit>
  void visit_row(std::size_t node, std::vector<FacetUse>& row, const Visit& visit) const {
    row.clear();
    for (std::uint64_t at = offsets_[node]; at < offsets_[node + 1]; ++at) {
      row.push_back(use_of(entries_[at]));
    }
    std::ranges::sort(row, [](const FacetUse& a, const FacetUse& b) {
      return a.corners != b.corners ? a.corners < b.corners : a.element < b.element;
    });
    for (std::size_t first = 0, last = 0; first < row.size(); first = last) {
      while (last < row.size() && row[last].corners == row[first].corners) ++last;
      visit(std::span<const FacetUse>(row).subspan(first, last - first));
    }
  }

 private:
  static constexpr std::uint64_t kFacets =
      8;  // an entry is the element's id times this, and number

  [[nodiscard]] std::size_t block_of(std::size_t element) const {
    const auto after = std::ranges::upper_bound(first_elements_, element);
    return static_cast<std::size_t>(after - first_elements_.begin()) - 1;
  }

  [[nodiscard]] FacetUse use_of(std::uint64_t entry) const {
    const auto element = static_cast<std::size_t>(entry / kFacets);
    const std::size_t b = block_of(element);
    const ElementBlockView& block = topology_.blocks[b];
    FacetUse use{{-1, -1, -1, -1},
                 block.type,
                 static_cast<std::int8_t>(entry % kFacets),
                 element,
                 &block.nodes[(element - first_elements_[b]) * element_width(block.type)]};
    const FacetShape& facet = element_shape(block.type).facets[use.number];
    for (int n = 0; n < facet.node_count; ++n) use.corners[n] = use.nodes[facet.nodes[n]];
    std::ranges::sort(use.corners);
    return use;
  }

  template <class Take>
  void for_each_facet(const std::function<void()>& check, const Take& take) const {
    constexpr std::size_t kPart = std::size_t{1} << 18;
    for (std::size_t b = 0; b < topology_.blocks.size(); ++b) {
      const std::size_t count = topology_.blocks[b].element_count();
      for (std::size_t first = 0; first < count; first += kPart) {
        check();
        parallel_for_ranges(std::min(kPart, count - first),
                            [&](std::size_t begin, std::size_t end) {
                              for (std::size_t e = first + begin; e < first + end; ++e)
                                take_facets(b, e, take);
                            });
      }
    }
  }

  /// Of element `e` of block `b`.
  template <class Take>
  void take_facets(std::size_t b, std::size_t e, const Take& take) const {
    const ElementBlockView& block = topology_.blocks[b];
    const ElementShape& shape = element_shape(block.type);
    const NodeId* const nodes = &block.nodes[e * element_width(block.type)];
    for (int f = 0; f < shape.facet_count; ++f) {
      const FacetShape& facet = shape.facets[f];
      NodeId lowest = nodes[facet.nodes[0]];
      for (int n = 1; n < facet.node_count; ++n) lowest = std::min(lowest, nodes[facet.nodes[n]]);
      take(static_cast<std::size_t>(lowest),
           (first_elements_[b] + e) * kFacets + static_cast<std::uint64_t>(f));
    }
  }

  TopologyView topology_;
  std::vector<std::size_t> first_elements_;  // of the blocks
  std::vector<std::uint64_t> offsets_;       // of each node's row, and the end
  std::vector<std::uint64_t> entries_;
};

}  // namespace meshsmooth::detail
