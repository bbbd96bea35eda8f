#pragma once

#include <array>
#include <optional>
#include <span>

#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// An element by value.
struct PlainElement {
  ElementType type;
  std::array<NodeId, kMaxElementNodes> nodes;

  [[nodiscard]] std::span<const NodeId> list() const {
    return std::span(nodes).first(element_width(type));
  }
};

/// @returns whether an element lists a node twice
[[nodiscard]] bool repeats_nodes(std::span<const NodeId> nodes);

/// Finds the element that a collapsed one is: its faces, less those that have become edges, are
/// those of a type with fewer corners. Nodes in the middle of an edge that has become a corner
/// repeat it, those of edges that have become one are the same.
///
/// @returns nothing where the faces form no type
[[nodiscard]] std::optional<PlainElement> expand(ElementType type, std::span<const NodeId> nodes);

}  // namespace meshsmooth::detail
