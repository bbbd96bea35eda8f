#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <vector>

#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/cpu/neighbours.hpp"
#include "smooth/steps/boundary.hpp"

namespace meshsmooth::detail {

/// A node has at most this many edges, and facets, in one element.
inline constexpr std::size_t kMostNeighboursInElement = 4;

/// Counts how often each key of a row occurs; emptied in O(1), grows with its row.
template <class Key>
class RowCounter {
 public:
  struct Slot {
    Key key;
    std::uint32_t epoch;
    std::uint32_t count;
  };

  /// Empties it; at most `capacity` different keys will come.
  void clear(std::size_t capacity) {
    if (slots_.size() < 2 * capacity) {
      slots_.assign(std::bit_ceil(std::max<std::size_t>(2 * capacity, 256)), Slot{});
      shift_ = 64 - std::countr_zero(slots_.size());
      epoch_ = 0;
    }
    if (++epoch_ == 0) {
      std::fill(slots_.begin(), slots_.end(), Slot{});
      epoch_ = 1;
    }
    used_.resize(std::max(used_.size(), capacity));
    size_ = 0;
  }

  void add(Key key) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = (bits(key) * 0x9e3779b97f4a7c15U) >> shift_;; at = (at + 1) & mask) {
      Slot& slot = slots_[at];
      if (slot.epoch != epoch_) {
        slot = {key, epoch_, 1};
        used_[size_++] = static_cast<std::uint32_t>(at);
        return;
      }
      if (slot.key == key) {
        ++slot.count;
        return;
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  /// The n-th different key, in the order of their coming.
  [[nodiscard]] const Slot& operator[](std::size_t n) const { return slots_[used_[n]]; }

 private:
  static std::uint64_t bits(NodeId node) { return static_cast<std::uint64_t>(node); }
  template <class Facet>
  static std::uint64_t bits(const Facet& facet) {
    return facet.first_two ^ (static_cast<std::uint64_t>(facet.third) << 16);
  }

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> used_;
  std::size_t size_ = 0;
  std::uint32_t epoch_ = 0;
  int shift_ = 0;
};

/// `find_rings_by_sorting` from the balls: per node the union of its elements'
/// edges. O(ball entries * nodes per element); the entries are held twice while
/// the rows are put together.
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
      row.clear(balls.size(node) * kMostNeighboursInElement);
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

/// The other nodes of a facet whose lowest node is known, ascending.
struct FacetRest {
  std::uint64_t first_two;
  NodeId third;  // -1: the facet has no more

  friend bool operator==(const FacetRest&, const FacetRest&) = default;
};

inline std::uint64_t ordered_pair(NodeId a, NodeId b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) |
         static_cast<std::uint64_t>(std::max(a, b));
}

/// Adds the facets of an element whose lowest node is `node`.
inline void add_facets(const ElementView& element, NodeId node, RowCounter<FacetRest>& facets) {
  const ElementShape& shape = *element.shape;
  if (shape.dimension == 3 && shape.node_count == 4) {
    NodeId higher[4];
    int count = 0;
    for (int n = 0; n < 4; ++n) {  // without a branch: it could not be foreseen
      higher[count] = element.nodes[n];
      count += element.nodes[n] > node ? 1 : 0;
    }
    if (count >= 2) facets.add({ordered_pair(higher[0], higher[1]), -1});
    if (count == 3) {
      facets.add({ordered_pair(higher[0], higher[2]), -1});
      facets.add({ordered_pair(higher[1], higher[2]), -1});
    }
    return;
  }
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetKey key = facet_key(element, f);
    const int skipped = 4 - shape.facets[f].node_count;
    if (key.nodes[skipped] != node) continue;
    const NodeId second = skipped < 2 ? key.nodes[skipped + 2] : key.nodes[skipped + 1];
    facets.add({ordered_pair(key.nodes[skipped + 1], second), skipped == 0 ? key.nodes[3] : -1});
  }
}

/// `find_boundary_by_sorting` from the balls: each facet is counted in the ball
/// of its lowest node. O(ball entries).
[[nodiscard]] inline bool find_boundary(CpuExecutor& executor, std::size_t node_count,
                                        const Elements& elements, const Rows<ElementId>& balls,
                                        std::uint8_t* on_boundary) {
  executor.for_each(node_count, [=](std::size_t node) { on_boundary[node] = 0; });
  std::atomic<bool> overused = false;
  const auto mark = [=](NodeId node) { CpuExecutor::store(on_boundary[node], std::uint8_t{1}); };
  executor.for_each_range(node_count, [&](std::size_t begin, std::size_t end) {
    RowCounter<FacetRest> facets;
    for (std::size_t node = begin; node < end; ++node) {
      facets.clear(balls.size(node) * kMostNeighboursInElement);
      for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
        add_facets(elements[*e], static_cast<NodeId>(node), facets);
      }
      for (std::size_t n = 0; n < facets.size(); ++n) {
        const auto& [facet, epoch, count] = facets[n];
        if (count > 2) overused.store(true, std::memory_order_relaxed);
        if (count != 1) continue;
        mark(static_cast<NodeId>(node));
        mark(static_cast<NodeId>(facet.first_two >> 32));
        mark(static_cast<NodeId>(facet.first_two & 0xffffffffU));
        if (facet.third >= 0) mark(facet.third);
      }
    }
  });
  return !overused;
}

}  // namespace meshsmooth::detail
