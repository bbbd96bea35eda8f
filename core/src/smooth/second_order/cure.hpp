#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

/// Moves nodes of invalid elements of second order, and around them, until the elements are valid
/// or no visit helps. Nodes take turns; each lowers, over the elements at it, the sum of 1 / h(c)
/// over the Bézier coefficients c of the Jacobian, h(c) = (c + sqrt(c² + 4 δ²)) / 2: convex in the
/// node's position, since the coefficients are linear in it. An element that is valid stays so.
///
/// Source of h: Escobar et al. 2003, "Simultaneous untangling and smoothing of tetrahedral meshes";
/// of the measure: Toulorge, Geuzaine, Remacle, Lambrechts 2013, "Robust untangling of curvilinear
/// meshes".
///
/// takes  `held`: [nodes], not 0: stays; `goes_on`: asked every few visits, false ends with what is
///        reached, and it may throw
/// cost   about 30 us a visit of a node among tetrahedra; invalid elements and two rings around
///        them, in at most 60 sweeps
/// order  deterministic
/// gives  the number of nodes that moved, `positions`
template <class Real>
std::int64_t cure(const TopologyView& topology, std::span<const std::uint8_t> held,
                  const SurfaceOrientation& orientation, std::span<Vec3<Real>> positions,
                  const std::function<bool()>& goes_on);

}  // namespace meshsmooth::detail
