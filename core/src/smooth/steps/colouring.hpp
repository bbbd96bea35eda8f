#pragma once

#include <vector>

#include "smooth/rules/rules.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// Free nodes grouped so that no two of one colour share an element: the nodes
/// of a colour may move at the same time without seeing each other.
template <Executor E>
struct Colouring {
  typename E::template Buffer<NodeId> nodes;  // colour after colour, ascending inside
  std::vector<std::size_t> first;             // colour c: nodes[first[c] .. first[c + 1])

  [[nodiscard]] std::size_t count() const { return first.empty() ? 0 : first.size() - 1; }
};

/// A bijection of 32-bit numbers that looks random: the order in which nodes
/// choose their colours.
MESHSMOOTH_HD inline std::uint32_t colour_priority(NodeId caller_id) {
  auto h = static_cast<std::uint32_t>(caller_id);
  h = (h ^ (h >> 16)) * 0x85ebca6bU;
  h = (h ^ (h >> 13)) * 0xc2b2ae35U;
  return h ^ (h >> 16);
}

/// Calls `body(other)` for the nodes that share an element with `node` until it
/// returns false; says whether it never did. In a mesh of simplices they are the
/// ring; else some are visited more than once.
template <class Body>
MESHSMOOTH_HD bool visit_adjacent(const Surroundings& around, std::size_t node, const Body& body) {
  if (around.elements.simplices()) {
    for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
      if (!body(*n)) return false;
    }
    return true;
  }
  for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
    const ElementView element = around.elements[*e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      if (!body(element.nodes[n])) return false;
    }
  }
  return true;
}

/// `visit_adjacent` over the free nodes that choose before `node`.
template <class Body>
MESHSMOOTH_HD bool visit_higher(const Surroundings& around, const NodeId* caller_ids,
                                std::size_t node, const Body& body) {
  const std::uint32_t own = colour_priority(caller_ids[node]);
  return visit_adjacent(around, node, [&](NodeId other) {
    return around.fixed[other] != 0 || colour_priority(caller_ids[other]) <= own || body(other);
  });
}

inline constexpr std::uint32_t kNoColour = 0xffffffffU;

/// Gives a node the lowest colour that none of its neighbours before it has, if
/// they all have one; says whether it did.
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

/// First-fit in the order of `colour_priority`, found in parallel: a node
/// chooses once all its neighbours of higher priority have. The result is that
/// of the serial first-fit, whatever the schedule. Source: Jones, Plassmann
/// 1993, "A parallel graph coloring heuristic".
///
/// needs  `around.balls`
/// cost   O(ball entries) in about log n rounds; 12 B a node while it runs
template <Executor E>
Colouring<E> colour_nodes(E& executor, const Surroundings& around, const NodeId* caller_ids) {
  const std::size_t node_count = around.node_count;
  auto colours = executor.template allocate<std::uint32_t>(node_count);
  std::uint32_t* const colour = colours.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { colour[node] = kNoColour; });

  for (std::size_t open = 1; open > 0;) {
    open = executor.reduce(
        node_count, std::size_t{0},
        [=] MESHSMOOTH_HD(std::size_t node) -> std::size_t {
          if (around.fixed[node] != 0 || colour[node] != kNoColour) return 0;
          return choose_colour<E>(around, caller_ids, node, colour) ? 0 : 1;
        },
        [] MESHSMOOTH_HD(std::size_t a, std::size_t b) { return a + b; });
  }

  auto keys = executor.template allocate<std::uint64_t>(node_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    key[node] = (static_cast<std::uint64_t>(colour[node]) << 32) | node;
  });
  executor.sort(key, node_count);

  Colouring<E> result;
  const auto lower_bound = [&](std::uint64_t value) {
    return executor.lower_bound(key, node_count, value);
  };
  const std::size_t free_count = lower_bound(std::uint64_t{kNoColour} << 32);
  for (std::uint64_t c = 0; result.first.empty() || result.first.back() < free_count; ++c) {
    result.first.push_back(lower_bound(c << 32));
  }
  result.nodes = executor.template allocate<NodeId>(free_count);
  NodeId* const nodes = result.nodes.data();
  executor.for_each(free_count, [=] MESHSMOOTH_HD(std::size_t n) {
    nodes[n] = static_cast<NodeId>(key[n] & 0xffffffffU);
  });
  return result;
}

}  // namespace meshsmooth::detail
