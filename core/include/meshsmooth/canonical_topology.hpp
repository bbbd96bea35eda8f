#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/numbering.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {

/// A topology as it is meant, apart from how it is written. Jobs and evaluations work on it, the
/// caller's numbering of nodes and elements stays:
///
/// - collapsed elements, which repeat nodes, are of the type that their other faces form: wedge,
///   pyramid, tetrahedron, triangle;
/// - interface elements, two opposite facets of which coincide node by node, are left out, and
///   their nodes are fixed;
/// - mirrored elements are numbered like the others (numbering.hpp);
/// - nodes of the boundary that have one position (the two sides of a crack, parts that touch) are
///   fixed where the boundary moves.
///
/// What else the given topology views must outlive it. O(elements log star size).
class CanonicalTopology {
 public:
  /// The part that needs no positions: collapsed elements.
  /// @throws InvalidMesh (REPEATED_NODE) for one that forms no type
  explicit CanonicalTopology(const TopologyView& topology);
  /// @param topology   valid but for repeated nodes
  /// @param positions  [topology.node_count]
  /// @param boundary_moves  whether nodes of the boundary may
  /// @param check      called between parts of the work; what it throws ends it
  CanonicalTopology(
      const TopologyView& topology, const PositionsView& positions, bool boundary_moves = false,
      const std::function<void()>& check = [] {});
  CanonicalTopology(const CanonicalTopology&) = delete;
  CanonicalTopology& operator=(const CanonicalTopology&) = delete;

  /// @returns whether it differs from the topology given
  [[nodiscard]] bool changed() const {
    return collapsed_count_ > 0 || interface_count_ > 0 || coincident_count_ > 0 ||
           numbering_.mirrored_count > 0;
  }
  /// @returns the number of boundary nodes that share their position
  [[nodiscard]] std::int64_t coincident_count() const { return coincident_count_; }
  [[nodiscard]] const TopologyView& view() const { return view_; }
  [[nodiscard]] std::int64_t bytes() const;
  /// @returns the caller's id of an element
  [[nodiscard]] std::int64_t caller_id(std::int64_t element) const {
    return ids_.empty() ? element : ids_[static_cast<std::size_t>(element)];
  }

  /// Adds the counts and lists of this class to a report on `view()`, and names its elements by the
  /// caller's ids.
  void complete(QualityStats& stats) const;
  /// Orders the values of all elements by the caller's ids; NaN for interface elements.
  void complete(ElementQualityArrays& arrays) const;
  /// @param values  [view().element_count()]
  /// @param other   the value of interface elements
  /// @returns the values by the caller's ids
  template <class T>
  [[nodiscard]] std::vector<T> in_caller_order(std::span<const T> values, T other) const {
    if (ids_.empty()) return {values.begin(), values.end()};
    std::vector<T> all(caller_element_count_, other);
    for (std::size_t e = 0; e < values.size(); ++e) {
      all[static_cast<std::size_t>(ids_[e])] = values[e];
    }
    return all;
  }

 private:
  /// An element to append.
  void add(ElementType type, std::span<const NodeId> nodes);
  void view_blocks();
  void expand_collapsed(const TopologyView& topology);
  void leave_out_interfaces(const PositionsView& positions);
  void fix_coincident(const PositionsView& positions);
  void fix(NodeId node);

  std::vector<ElementBlock> blocks_;  // runs of one type, in the caller's order; empty: as given
  std::vector<ElementBlockView> block_views_;
  std::vector<std::uint8_t> fixed_;
  std::vector<std::int32_t> regions_;
  std::vector<std::int64_t> ids_;  // by the caller, ascending; empty: the same
  TopologyView view_;
  Numbering numbering_;
  std::size_t caller_element_count_;
  std::int64_t collapsed_count_ = 0;
  std::int64_t interface_count_ = 0;
  std::int64_t coincident_count_ = 0;
};

}  // namespace meshsmooth
