#pragma once

#include <cstdint>

#include "smooth/linear/laplace_matrix.hpp"

namespace meshsmooth::detail {

/// Which couplings of a matrix are strong: -a_ij > threshold * sqrt(a_ii * a_jj). Rows without a
/// diagonal take no part.
struct StrongCouplings {
  LaplaceMatrix matrix;
  const float* diagonal;
  double threshold;

  [[nodiscard]] MESHSMOOTH_HD bool takes_part(std::size_t row) const { return diagonal[row] > 0; }

  /// Calls `visit(column, strength)` for the strong ones of a row, in its order; strength > 0.
  template <class Visit>
  MESHSMOOTH_HD void visit(std::size_t row, const Visit& visit) const {
    const double own = diagonal[row];
    if (!(own > 0)) return;
    for (std::int64_t k = matrix.rows.offsets[row]; k < matrix.rows.offsets[row + 1]; ++k) {
      const NodeId column = matrix.rows.entries[k];
      const double strength = -matrix.values[k];
      const double least = threshold * threshold * own * diagonal[column];
      if (strength > 0 && least > 0 && strength * strength > least) visit(column, strength);
    }
  }
};

/// Nodes grouped around roots: the unknowns of the next coarser level.
template <Executor E>
struct Aggregates {
  std::size_t count = 0;
  typename E::template Buffer<NodeId> of;  // by node; -1: in none
};

/// States of nodes while roots are found, ascending as they overrule each other.
inline constexpr std::uint64_t kNoRoot = 0;
inline constexpr std::uint64_t kRoot = std::uint64_t{1} << 33;

/// Of an undecided node: between the two, and another for each node, in no order.
MESHSMOOTH_HD inline std::uint64_t root_priority(std::size_t node) {
  auto hash = static_cast<std::uint32_t>(node);
  hash = (hash ^ (hash >> 16)) * 0x7feb352dU;  // a bijection
  hash = (hash ^ (hash >> 15)) * 0x846ca68bU;
  return (std::uint64_t{1} << 32) | (hash ^ (hash >> 16));
}

/// The highest state of a node and its strong neighbours.
MESHSMOOTH_HD inline std::uint64_t highest_state(const StrongCouplings& strong, std::size_t node,
                                                 const std::uint64_t* states) {
  std::uint64_t highest = states[node];
  strong.visit(node, [&](NodeId other, double) {
    if (states[other] > highest) highest = states[other];
  });
  return highest;
}

/// Finds roots of which no two are within two strong couplings of each other, and leaves no room
/// for another: a maximal independent set of distance two. Source: Bell, Dalton, Olson 2012,
/// "Exposing fine-grained parallelism in algebraic multigrid methods", 3.2.
///
/// gives  `states`: kRoot for them, kNoRoot for others
/// cost   about twelve rounds of two passes; 8 B a node
/// order  deterministic
template <Executor E>
void find_roots(E& executor, const StrongCouplings& strong, std::size_t node_count,
                std::uint64_t* states) {
  auto found = executor.template allocate<std::uint64_t>(node_count);
  std::uint64_t* const highest = found.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    bool any = false;
    strong.visit(node, [&](NodeId, double) { any = true; });
    states[node] = any ? root_priority(node) : kNoRoot;
  });
  for (std::int64_t open = 1; open > 0;) {
    executor.check();
    executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      highest[node] = highest_state(strong, node, states);
    });
    open = executor.reduce(
        node_count, std::int64_t{0},
        [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
          if (states[node] == kNoRoot || states[node] == kRoot) return 0;
          const std::uint64_t around = highest_state(strong, node, highest);
          if (around != kRoot && around != states[node]) return 1;
          states[node] = around == kRoot ? kNoRoot : kRoot;
          return 0;
        },
        Plus{});
  }
}

/// The aggregate of the strongest strong neighbour that has one; -1: none has.
MESHSMOOTH_HD inline NodeId aggregate_beside(const StrongCouplings& strong, std::size_t node,
                                             const NodeId* aggregates) {
  NodeId aggregate = -1;
  double strongest = 0;
  strong.visit(node, [&](NodeId other, double strength) {
    if (strength <= strongest || aggregates[other] < 0) return;
    strongest = strength;
    aggregate = aggregates[other];
  });
  return aggregate;
}

/// Groups nodes around roots along strong couplings, two of them at most. A node without any is in
/// no aggregate: smoothing alone solves its row.
///
/// cost   `find_roots` and three passes; 20 B a node while it runs, of which 4 stay
/// order  deterministic; aggregates are numbered in the order of their roots
template <Executor E>
Aggregates<E> find_aggregates(E& executor, const StrongCouplings& strong, std::size_t node_count) {
  auto state_array = executor.template allocate<std::uint64_t>(node_count);
  std::uint64_t* const states = state_array.data();
  find_roots(executor, strong, node_count, states);

  auto near_array = executor.template allocate<NodeId>(node_count);
  NodeId* const near = near_array.data();
  Aggregates<E> result;
  {
    auto numbers_array = executor.template allocate<std::int64_t>(node_count);
    std::int64_t* const numbers = numbers_array.data();
    executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      numbers[node] = states[node] == kRoot ? 1 : 0;
    });
    result.count = static_cast<std::size_t>(executor.exclusive_scan(numbers, node_count));
    executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      near[node] = states[node] == kRoot ? static_cast<NodeId>(numbers[node]) : -1;
    });
  }
  // Roots, their neighbours, the neighbours of those.
  auto last_array = executor.template allocate<NodeId>(node_count);
  NodeId* const last = last_array.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    last[node] = near[node] >= 0 ? near[node] : aggregate_beside(strong, node, near);
  });
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    near[node] = last[node] >= 0 ? last[node] : aggregate_beside(strong, node, last);
  });
  result.of = std::move(near_array);
  return result;
}

}  // namespace meshsmooth::detail
