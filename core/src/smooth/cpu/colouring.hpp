#pragma once

#include <algorithm>

#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/rules/colouring_rule.hpp"
#include "smooth/steps/sweep_context.hpp"

namespace meshsmooth::detail {

/// Bytes of a colouring of n nodes, and what `colour_nodes` holds while it runs.
[[nodiscard]] constexpr std::int64_t colouring_bytes(std::int64_t n) { return n * 4; }
[[nodiscard]] constexpr std::int64_t colouring_nodes_bytes(std::int64_t n) { return n * (4 + 8); }

/// First-fit in the order of `colour_priority`, in parallel: a node chooses once all its
/// neighbours of higher priority have. The result is that of the serial first-fit. Source: Jones,
/// Plassmann 1993, "A parallel graph coloring heuristic".
///
/// needs  `around.balls`
/// cost   O(ball entries) in about log n rounds; 12 B a node while it runs
inline Colouring<CpuExecutor> colour_nodes(CpuExecutor& executor, const Surroundings& around,
                                           const NodeId* caller_ids) {
  const std::size_t node_count = around.node_count;
  auto colours = executor.allocate<std::uint32_t>(node_count);
  std::uint32_t* const colour = colours.data();
  executor.for_each(node_count, [=](std::size_t node) { colour[node] = kNoColour; });

  for (std::size_t open = 1; open > 0;) {
    open = executor.reduce(
        node_count, std::size_t{0},
        [=](std::size_t node) -> std::size_t {
          if (around.fixed[node] != 0 || colour[node] != kNoColour) return 0;
          return choose_colour<CpuExecutor>(around, caller_ids, node, colour) ? 0 : 1;
        },
        Plus{});
  }

  auto keys = executor.allocate<std::uint64_t>(node_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(node_count, [=](std::size_t node) {
    key[node] = (static_cast<std::uint64_t>(colour[node]) << 32) | node;
  });
  executor.sort(key, node_count);

  Colouring<CpuExecutor> result;
  const auto lower_bound = [&](std::uint64_t value) {
    return static_cast<std::size_t>(std::lower_bound(key, key + node_count, value) - key);
  };
  const std::size_t free_count = lower_bound(std::uint64_t{kNoColour} << 32);
  for (std::uint64_t c = 0; result.first.empty() || result.first.back() < free_count; ++c) {
    result.first.push_back(lower_bound(c << 32));
  }
  result.nodes = executor.allocate<NodeId>(free_count);
  NodeId* const nodes = result.nodes.data();
  executor.for_each(free_count,
                    [=](std::size_t n) { nodes[n] = static_cast<NodeId>(key[n] & 0xffffffffU); });
  return result;
}

}  // namespace meshsmooth::detail
