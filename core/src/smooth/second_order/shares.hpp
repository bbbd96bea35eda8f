#pragma once

#include <algorithm>
#include <cstddef>

#include "mesh/parallel.hpp"
#include "mesh/spread.hpp"
#include "meshsmooth/mesh.hpp"

namespace meshsmooth::detail {

/// Elements that a thread takes at a time: a curved one costs up to a hundred straight ones, and
/// they lie together.
inline constexpr std::size_t kElementShare = 64;

/// Calls `functor(i)` for every i < `count`, `share` at a time, on the threads of the current
/// arena.
template <class Functor>
void for_each_share(std::size_t count, std::size_t share, const Functor& functor) {
  const std::size_t share_count = (count + share - 1) / share;
  parallel_for(share_count, [&](std::size_t index) {
    const std::size_t s = spread(index, share_count);
    for (std::size_t i = s * share; i < std::min(count, (s + 1) * share); ++i) functor(i);
  });
}

/// Calls `visit(type, nodes, element)` for all elements.
template <class Visit>
void for_each_element(const TopologyView& topology, const Visit& visit) {
  std::size_t first = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    for_each_share(block.element_count(), kElementShare, [&](std::size_t e) {
      visit(block.type, block.nodes.subspan(e * width, width), first + e);
    });
    first += block.element_count();
  }
}

}  // namespace meshsmooth::detail
