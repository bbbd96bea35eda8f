#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth {

/// Which elements list their nodes in the mirrored order. Two elements that share a facet number
/// it in opposite directions where they are numbered alike: this is in the connectivity, wherever
/// the nodes are, so it tells a mirrored element from an inverted one.
struct Numbering {
  /// [element_count], non-zero = mirrored; empty: none is.
  std::vector<std::uint8_t> mirrored;
  std::int64_t mirrored_count = 0;
  /// Facets across which no numbering of the elements is consistent: those that close a Möbius
  /// strip.
  std::int64_t cut_facet_count = 0;
};

/// Finds the mirrored elements of a valid topology by propagation over facets, for each connected
/// component on its own; facets of three and more elements do not connect. A component of a volume
/// mesh encloses a positive volume, unless all of it is numbered alike and most of its elements
/// have a positive one: then it is tangled. All components of a plane mesh have the same side; one
/// of a curved surface is changed only where it has both. Which side that is does not depend on
/// which elements are mirrored. O(elements log star size), multi-threaded but for the components;
/// the same result for any number of threads.
///
/// @param positions  [topology.node_count]
/// @param check      called between parts of the work; what it throws ends it
[[nodiscard]] Numbering find_numbering(
    const TopologyView& topology, const PositionsView& positions,
    const std::function<void()>& check = [] {});

/// Lists the nodes of mirrored elements in the other order, in place.
///
/// @param mirrored  [element count], non-zero = mirrored
void mirror_elements(std::span<ElementBlock> blocks, std::span<const std::uint8_t> mirrored);

/// Lists the nodes of one element in the mirrored order. Twice restores it.
void mirror_nodes(ElementType type, std::span<NodeId> nodes);

}  // namespace meshsmooth
