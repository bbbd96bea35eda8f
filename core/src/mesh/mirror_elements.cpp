#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "mesh/parallel.hpp"
#include "meshsmooth/numbering.hpp"

namespace meshsmooth {
namespace {

/// In the order of a type's nodes, which one stands there in the mirrored element.
using MirroredOrder = std::array<std::int8_t, kMaxElementNodes>;

MirroredOrder mirrored_corners(ElementType linear) {
  switch (linear) {
    case ElementType::triangle:
    case ElementType::tetrahedron:
      return {0, 2, 1, 3};
    case ElementType::quad:
    case ElementType::pyramid:
      return {0, 3, 2, 1, 4};
    case ElementType::wedge:
      return {0, 2, 1, 3, 5, 4};
    default:
      return {0, 3, 2, 1, 4, 7, 6, 5};
  }
}

/// Nodes in the middle go where their corners go.
MirroredOrder find_mirrored_order(ElementType type) {
  MirroredOrder order = mirrored_corners(linear_type(type));
  const auto mids = mid_nodes(type);
  const auto corner_count = static_cast<std::size_t>(element_shape(type).node_count);
  for (std::size_t m = 0; m < mids.size(); ++m) {
    const auto corners_of = [&](const MidNode& mid, bool mirrored) {
      unsigned corners = 0;  // a bit each
      for (int c = 0; c < mid.corner_count; ++c) {
        const std::int8_t corner = mid.corners[c];
        corners |= 1U << (mirrored ? order[corner] : corner);
      }
      return corners;
    };
    for (std::size_t other = 0; other < mids.size(); ++other) {
      if (corners_of(mids[other], false) == corners_of(mids[m], true)) {
        order[corner_count + m] = static_cast<std::int8_t>(corner_count + other);
      }
    }
  }
  return order;
}

void reorder(const MirroredOrder& order, std::span<NodeId> nodes) {
  std::array<NodeId, kMaxElementNodes> copy{};
  std::ranges::copy(nodes, copy.begin());
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] = copy[order[n]];
}

/// Of the elements of a block.
void mirror_block(ElementType type, std::span<NodeId> nodes,
                  std::span<const std::uint8_t> mirrored) {
  const MirroredOrder order = find_mirrored_order(type);
  const std::size_t width = element_width(type);
  detail::parallel_for_ranges(mirrored.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      if (mirrored[e] != 0) reorder(order, nodes.subspan(e * width, width));
    }
  });
}

}  // namespace

void mirror_nodes(ElementType type, std::span<NodeId> nodes) {
  reorder(find_mirrored_order(type), nodes);
}

void mirror_elements(std::span<ElementBlock> blocks, std::span<const std::uint8_t> mirrored) {
  std::size_t first = 0;
  for (ElementBlock& block : blocks) {
    const std::size_t count = block.nodes.size() / element_width(block.type);
    mirror_block(block.type, block.nodes, mirrored.subspan(first, count));
    first += count;
  }
}

}  // namespace meshsmooth
