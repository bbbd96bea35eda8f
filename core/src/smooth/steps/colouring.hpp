#pragma once

#include <vector>

#include "smooth/rules/colouring_rule.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// Free nodes grouped so that no two of one colour share an element: all nodes of a colour can
/// move concurrently.
template <Executor E>
struct Colouring {
  typename E::template Buffer<NodeId> nodes;  // colour after colour, ascending inside
  std::vector<std::size_t> first;             // colour c: nodes[first[c] .. first[c + 1])

  [[nodiscard]] std::size_t count() const { return first.empty() ? 0 : first.size() - 1; }
};

}  // namespace meshsmooth::detail
