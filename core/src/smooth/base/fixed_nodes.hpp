#pragma once

#include <cstdint>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::detail {

/// How the search for the boundary marks a node. The second mark, of the edges that three or more
/// elements of a surface mesh share, hides the first.
inline constexpr std::uint8_t kOnBoundary = 1;
inline constexpr std::uint8_t kOnNonManifoldEdge = 2;

/// Counts of nodes by `FixRule`.
struct FixedCounts {
  NodeCounts nodes;
  std::int64_t free = 0;

  friend MESHSMOOTH_HD FixedCounts operator+(const FixedCounts& a, const FixedCounts& b) {
    return {
        {.total = a.nodes.total + b.nodes.total,
         .boundary = a.nodes.boundary + b.nodes.boundary,
         .fixed = a.nodes.fixed + b.nodes.fixed,
         .isolated = a.nodes.isolated + b.nodes.isolated,
         .on_non_manifold_edges = a.nodes.on_non_manifold_edges + b.nodes.on_non_manifold_edges},
        a.free + b.free};
  }
};

/// Turns the marks of the boundary into those of the fixed nodes: the boundary unless it is free,
/// nodes on non-manifold edges, the caller's, and nodes in no element. (`constrain` frees those
/// that may slide, and tells nodes on non-manifold edges by their mark, which they keep.)
struct FixRule {
  const NodeId* caller_ids;
  const std::uint8_t* mask;  // by the caller's ids, or null
  bool boundary_fixed;
  std::uint8_t* fixed;  // before: the boundary's marks

  /// To be called once for each node.
  MESHSMOOTH_HD FixedCounts operator()(std::size_t node, bool isolated) const {
    const bool boundary = fixed[node] == kOnBoundary;
    const bool non_manifold = fixed[node] == kOnNonManifoldEdge;
    const bool by_caller = mask != nullptr && mask[caller_ids[node]] != 0;
    const bool held = (boundary && boundary_fixed) || non_manifold || by_caller;
    if (!non_manifold) fixed[node] = held || isolated ? 1 : 0;
    return {{.total = 1,
             .boundary = boundary ? 1 : 0,
             .fixed = held ? 1 : 0,
             .isolated = isolated ? 1 : 0,
             .on_non_manifold_edges = non_manifold ? 1 : 0},
            held || isolated ? 0 : 1};
  }
};

}  // namespace meshsmooth::detail
