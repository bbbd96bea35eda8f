#pragma once

#include "smooth/base/surroundings.hpp"

namespace meshsmooth::detail {

/// A bijective 32-bit hash: the order in which nodes choose their colours.
MESHSMOOTH_HD inline std::uint32_t colour_priority(NodeId caller_id) {
  auto h = static_cast<std::uint32_t>(caller_id);
  h = (h ^ (h >> 16)) * 0x85ebca6bU;
  h = (h ^ (h >> 13)) * 0xc2b2ae35U;
  return h ^ (h >> 16);
}

/// Calls `visit(other)` for the nodes that share an element with `node` until it
/// returns false; returns whether it never did. In a mesh of simplices they are the
/// ring; else some are visited more than once.
template <class Visitor>
MESHSMOOTH_HD bool visit_adjacent(const Surroundings& around, std::size_t node,
                                  const Visitor& visit) {
  if (around.elements.simplices()) {
    for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
      if (!visit(*n)) return false;
    }
    return true;
  }
  for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
    const ElementView element = around.elements[*e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      if (!visit(element.nodes[n])) return false;
    }
  }
  return true;
}

/// `visit_adjacent` over the free nodes that choose before `node`.
template <class Visitor>
MESHSMOOTH_HD bool visit_higher(const Surroundings& around, const NodeId* caller_ids,
                                std::size_t node, const Visitor& visit) {
  const std::uint32_t own = colour_priority(caller_ids[node]);
  return visit_adjacent(around, node, [&](NodeId other) {
    return around.fixed[other] != 0 || colour_priority(caller_ids[other]) <= own || visit(other);
  });
}

inline constexpr std::uint32_t kNoColour = 0xffffffffU;

/// Gives a node the lowest colour that none of its neighbours before it has, if
/// they all have one; returns whether it did.
template <class E>
MESHSMOOTH_HD bool choose_colour(const Surroundings& around, const NodeId* caller_ids,
                                 std::size_t node, std::uint32_t* colours) {
  const bool ready = visit_higher(
      around, caller_ids, node, [=](NodeId other) { return E::load(colours[other]) != kNoColour; });
  if (!ready) return false;
  for (std::uint32_t base = 0;; base += 64) {
    std::uint64_t taken = 0;
    visit_higher(around, caller_ids, node, [&](NodeId other) {
      const std::uint32_t c = E::load(colours[other]);
      if (c >= base && c < base + 64) taken |= std::uint64_t{1} << (c - base);
      return true;
    });
    if (~taken == 0) continue;
    std::uint32_t free = base;
    for (; (taken & 1U) != 0; taken >>= 1) ++free;
    E::store(colours[node], free);
    return true;
  }
}

}  // namespace meshsmooth::detail
