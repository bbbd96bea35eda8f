#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

/// An element of the part of the mesh that is repaired.
struct PartElement {
  ElementType type;
  std::span<const NodeId> nodes;
  Vec3d reference;
  double scale = 1;  // of its coefficients
  double worst = 1;  // nearness of one of them, over the scale
  bool valid = false;
};

/// The part of a mesh that is repaired: nodes that may move, all elements at them, and in which
/// order the nodes take turns. Nodes of the boundary and between regions do not move.
class RepairedPart {
 public:
  /// What its bytes follow from.
  struct Size {
    std::int64_t nodes = 0, elements = 0;                     // of the mesh
    std::int64_t part_elements = 0, entries = 0, facets = 0;  // of the part; entries: their nodes

    void add(ElementType type, std::int64_t count);
    [[nodiscard]] std::int64_t bytes() const;
  };

  /// `chosen`: [nodes], not 0: of an element that needs a repair; `rings` around them move too, but
  /// for `held`. On the threads of the current arena. O(nodes + elements). Deterministic.
  RepairedPart(const TopologyView& topology, const SurfaceOrientation& orientation,
               std::vector<std::uint8_t> chosen, int rings, std::span<const std::uint8_t> held);

  [[nodiscard]] std::vector<PartElement>& part_elements() { return part_elements_; }
  [[nodiscard]] const std::vector<PartElement>& part_elements() const { return part_elements_; }
  /// @returns the nodes that move, ascending
  [[nodiscard]] std::span<const NodeId> nodes() const { return nodes_; }
  /// @returns the elements of the part at a node, by its index in `nodes`
  [[nodiscard]] std::span<const std::size_t> elements_at(std::size_t n) const {
    return std::span(elements_).subspan(first_element_[n],
                                        first_element_[n + 1] - first_element_[n]);
  }
  /// @returns indices of nodes; those of one colour share no element
  [[nodiscard]] const std::vector<std::vector<std::size_t>>& colours() const { return colours_; }
  /// @returns the bytes that it held at most
  [[nodiscard]] std::int64_t bytes() const { return size_.bytes(); }

 private:
  [[nodiscard]] std::vector<NodeId> boundary_of(const TopologyView& topology,
                                                const std::vector<std::uint8_t>& elements);
  void list_elements(std::size_t node_count);
  void colour();

  Size size_;
  std::vector<PartElement> part_elements_;
  std::vector<NodeId> nodes_;
  std::vector<std::size_t> first_element_, elements_;  // rows of elements, by index in `nodes_`
  std::vector<std::vector<std::size_t>> colours_;
};

/// Marks the nodes of an element, from any thread.
void mark_nodes(std::span<const NodeId> nodes, std::vector<std::uint8_t>& marks);

}  // namespace meshsmooth::detail
