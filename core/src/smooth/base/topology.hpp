#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// Index of an element inside a job: 32-bit unsigned.
using ElementId = std::uint32_t;

/// One element: its row of the table and its nodes.
struct ElementView {
  const ElementShape* shape;
  const NodeId* nodes;
};

/// Whether every two nodes of the type share an edge.
MESHSMOOTH_HD inline bool is_simplex(const ElementShape& shape) {
  return shape.edge_count * 2 == shape.node_count * (shape.node_count - 1);
}

/// The elements of a job: at most one run per type, in executor memory.
struct Elements {
  struct Run {
    const ElementShape* shape;
    const NodeId* nodes;
    std::size_t first;  // id of its first element
  };
  Run runs[kLinearTypeCount];
  int run_count = 0;
  std::size_t count = 0;
  bool tetrahedra = false;  // known to be all

  [[nodiscard]] MESHSMOOTH_HD bool simplices() const {
    return run_count == 1 && is_simplex(*runs[0].shape);
  }

  /// An element of any mesh, or of one that has tetrahedra alone.
  template <bool kTetrahedra>
  [[nodiscard]] MESHSMOOTH_HD ElementView get(std::size_t element) const {
    if constexpr (kTetrahedra) return {runs[0].shape, runs[0].nodes + 4 * element};
    return (*this)[element];
  }
  [[nodiscard]] MESHSMOOTH_HD ElementView operator[](std::size_t element) const {
    int run = 0;
    while (run + 1 < run_count && runs[run + 1].first <= element) ++run;
    const Run& r = runs[run];
    return {r.shape, r.nodes + (element - r.first) * static_cast<std::size_t>(r.shape->node_count)};
  }
};

/// The nodes of a facet in ascending order; missing ones are -1 and come first.
struct FacetKey {
  NodeId nodes[kMaxFacetNodes];

  friend bool operator==(const FacetKey& a, const FacetKey& b) = default;
  friend auto operator<=>(const FacetKey& a, const FacetKey& b) = default;
};

MESHSMOOTH_HD inline FacetKey facet_key(const ElementView& element, int facet) {
  const FacetShape& shape = element.shape->facets[facet];
  static_assert(kMaxFacetNodes == 4, "a key has as many -1 as a facet may have nodes");
  FacetKey key{{-1, -1, -1, -1}};
  for (int n = 0; n < shape.node_count; ++n) {
    const NodeId node = element.nodes[shape.nodes[n]];
    int at = kMaxFacetNodes - shape.node_count + n;
    for (; at > 0 && key.nodes[at - 1] > node; --at) key.nodes[at] = key.nodes[at - 1];
    key.nodes[at] = node;
  }
  return key;
}

/// Rows of ids, in executor memory: row i is entries[offsets[i] .. offsets[i+1]).
template <class Id>
struct Rows {
  const std::int64_t* offsets;  // row count + 1
  const Id* entries;

  [[nodiscard]] MESHSMOOTH_HD const Id* begin(std::size_t row) const {
    return entries + offsets[row];
  }
  [[nodiscard]] MESHSMOOTH_HD const Id* end(std::size_t row) const {
    return entries + offsets[row + 1];
  }
  [[nodiscard]] MESHSMOOTH_HD std::size_t size(std::size_t row) const {
    return static_cast<std::size_t>(offsets[row + 1] - offsets[row]);
  }
};

/// Sorts a row by `key(entry)`; keys differ. In a short row every entry counts the lower ones:
/// more comparisons, but no mispredicted branch. A heap sort keeps the rare long row O(n log n).
template <class Id, class Key>
MESHSMOOTH_HD void sort_row(Id* row, std::size_t count, const Key& key) {
  constexpr std::size_t kShort = 64;
  if (count <= kShort) {
    Id entries[kShort];
    decltype(key(row[0])) keys[kShort];
    for (std::size_t i = 0; i < count; ++i) {
      entries[i] = row[i];
      keys[i] = key(row[i]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t lower = 0;
      for (std::size_t j = 0; j < count; ++j) lower += keys[j] < keys[i] ? 1 : 0;
      row[lower] = entries[i];
    }
    return;
  }
  const auto sift_down = [&](std::size_t root, std::size_t size) {
    for (std::size_t child = 2 * root + 1; child < size; child = 2 * root + 1) {
      if (child + 1 < size && key(row[child]) < key(row[child + 1])) ++child;
      if (!(key(row[root]) < key(row[child]))) return;
      const Id swapped = row[root];
      row[root] = row[child];
      row[child] = swapped;
      root = child;
    }
  };
  for (std::size_t root = count / 2; root-- > 0;) sift_down(root, count);
  for (std::size_t size = count; size-- > 1;) {
    const Id swapped = row[0];
    row[0] = row[size];
    row[size] = swapped;
    sift_down(0, size);
  }
}

}  // namespace meshsmooth::detail
