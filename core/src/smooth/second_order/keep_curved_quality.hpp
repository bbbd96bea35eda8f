#pragma once

#include <span>

#include "meshsmooth/mesh.hpp"
#include "smooth/guard/kept_quality.hpp"

namespace meshsmooth::detail {

/// `keep_quality` of a mesh with curved elements: moves nodes of `after`, of all kinds, back to
/// `before` where whole curved elements are worse than the worst at first, `quality_before`. On the
/// threads of the current arena.
///
/// cost   a measure per element that moved, then rounds that measure what has changed
/// order  deterministic
/// gives  `after`, and how many nodes went back for what
template <class Real>
void keep_curved_quality(const TopologyView& topology, const SurfaceOrientation& orientation,
                         const JobPlan& plan, const QualityStats& quality_before,
                         std::span<const Vec3<Real>> before, std::span<Vec3<Real>> after,
                         KeptQuality& kept);

/// @returns the bytes that it holds, by the nodes of the mesh
[[nodiscard]] constexpr std::int64_t keep_curved_quality_bytes(std::int64_t nodes) {
  return nodes * (1 + 1 + 8);
}

}  // namespace meshsmooth::detail
