#pragma once

#include <algorithm>

#include "smooth/base/colouring_rule.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::detail {

/// Bytes of a colouring of n nodes, and what `colour_nodes` holds while it runs.
[[nodiscard]] constexpr std::int64_t colouring_bytes(std::int64_t n) { return n * 4; }
[[nodiscard]] constexpr std::int64_t colouring_nodes_bytes(std::int64_t n) { return n * (4 + 8); }

/// Colours the nodes that have none yet, one after the other. O(n log n + ball entries).
inline void colour_serially(CpuExecutor& executor, const Surroundings& around,
                            const NodeId* caller_ids, std::uint32_t* colours) {
  const std::size_t node_count = around.node_count;
  auto keys = executor.allocate<std::uint64_t>(node_count);
  std::uint64_t* const key = keys.data();
  executor.for_each(node_count, [=](std::size_t node) {
    const std::uint32_t later = ~colour_priority(caller_ids[node]);
    key[node] = (static_cast<std::uint64_t>(later) << 32) | node;
  });
  executor.sort(key, node_count);
  for (std::size_t n = 0; n < node_count; ++n) {
    const auto node = static_cast<std::size_t>(key[n] & 0xffffffffU);
    if (n % 1024 == 0) executor.check();
    if (around.fixed[node] != 0 || colours[node] != kNoColour) continue;
    choose_colour<CpuExecutor>(around, caller_ids, node, colours);
  }
}

/// First-fit in the order of `colour_priority`, in parallel: a node chooses once all its
/// neighbours of higher priority have. The result is that of the serial first-fit. Source: Jones,
/// Plassmann 1993, "A parallel graph coloring heuristic". Ids can be chosen so that there are as
/// many rounds as nodes, so a serial pass ends what is open after some.
///
/// needs  `around.balls`
/// cost   O(n log n + ball entries), usually in few rounds; 12 B a node while it runs
inline Colouring<CpuExecutor> colour_nodes(CpuExecutor& executor, const Surroundings& around,
                                           const NodeId* caller_ids) {
  const std::size_t node_count = around.node_count;
  auto colours = executor.allocate<std::uint32_t>(node_count);
  std::uint32_t* const colour = colours.data();
  executor.for_each(node_count, [=](std::size_t node) { colour[node] = kNoColour; });

  constexpr int kMostRounds = 128;  // random ids: at most about e * neighbours + log n
  for (int round = 0;; ++round) {
    const std::size_t open = executor.reduce(
        node_count, std::size_t{0},
        [=](std::size_t node) -> std::size_t {
          if (around.fixed[node] != 0 || colour[node] != kNoColour) return 0;
          return choose_colour<CpuExecutor>(around, caller_ids, node, colour) ? 0 : 1;
        },
        Plus{});
    if (open == 0) break;
    if (round < kMostRounds) continue;
    colour_serially(executor, around, caller_ids, colour);
    break;
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
