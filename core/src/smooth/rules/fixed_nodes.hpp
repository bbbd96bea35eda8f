#pragma once

#include <cstdint>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::detail {

/// Counts of nodes by `FixRule`.
struct FixedCounts {
  NodeCounts nodes;
  std::int64_t free = 0;

  friend MESHSMOOTH_HD FixedCounts operator+(const FixedCounts& a, const FixedCounts& b) {
    return {{a.nodes.total + b.nodes.total, a.nodes.boundary + b.nodes.boundary,
             a.nodes.fixed + b.nodes.fixed, a.nodes.isolated + b.nodes.isolated, 0},
            a.free + b.free};
  }
};

/// Turns the marks of the boundary into those of the fixed nodes: the boundary unless it is free,
/// the caller's, and nodes in no element. (`constrain` frees those that may slide.)
struct FixRule {
  const NodeId* caller_ids;
  const std::uint8_t* mask;  // by the caller's ids, or null
  bool boundary_fixed;
  std::uint8_t* fixed;  // before: the boundary's marks

  /// To be called once for each node.
  MESHSMOOTH_HD FixedCounts operator()(std::size_t node, bool isolated) const {
    const bool boundary = fixed[node] != 0;
    const bool by_caller = mask != nullptr && mask[caller_ids[node]] != 0;
    const bool held = (boundary && boundary_fixed) || by_caller;
    fixed[node] = held || isolated ? 1 : 0;
    return {{1, boundary ? 1 : 0, held ? 1 : 0, isolated ? 1 : 0, 0}, held || isolated ? 0 : 1};
  }
};

}  // namespace meshsmooth::detail
