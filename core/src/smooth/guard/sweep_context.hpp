#pragma once

#include <vector>

#include "smooth/base/executor.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/guard/acceptance.hpp"

namespace meshsmooth::detail {

/// Free nodes grouped so that no two of one colour share an element: all nodes of a colour can
/// move concurrently.
template <Executor E>
struct Colouring {
  typename E::template Buffer<NodeId> nodes;  // colour after colour, ascending inside
  std::vector<std::size_t> first;             // colour c: nodes[first[c] .. first[c + 1])

  [[nodiscard]] std::size_t count() const { return first.empty() ? 0 : first.size() - 1; }
};

/// Visits every node of a colouring, colour by colour; returns the sum of what `visit(node)` gives.
template <class Stats, Executor E, class Visit, class Real>
Stats reduce_by_colour(E& executor, const Colouring<E>& colouring, const Visit& visit,
                       const Lookahead<Real>& look_ahead) {
  Stats sum;
  for (std::size_t c = 0; c < colouring.count(); ++c) {
    const NodeId* const nodes = colouring.nodes.data() + colouring.first[c];
    const std::size_t count = colouring.first[c + 1] - colouring.first[c];
    const auto visit_nth = [=] MESHSMOOTH_HD(std::size_t n) {
      look_ahead(nodes, n, count);
      return visit(static_cast<std::size_t>(nodes[n]));
    };
    sum = sum + executor.reduce(count, Stats{}, visit_nth, Plus{});
  }
  return sum;
}

/// What all sweeps of a job share. Functors capture it by value; pointers to what executors own are
/// for the host.
template <Executor E, class Real>
struct SweepContext {
  Surroundings around;
  const Colouring<E>* colouring = nullptr;  // of the deterministic in-place form
  Acceptance acceptance{};
  DisplacementLimit<Real> displacement_limit{};
  typename E::Suspects* suspects = nullptr;  // memory to find them in; null: to visit all elements
};

}  // namespace meshsmooth::detail
