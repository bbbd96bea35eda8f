#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

/// Finds the nodes among curved quadrilaterals, hexahedra and other boxes with right angles. Such
/// elements are their own target, as straight ones are; that does not show in the mesh of their
/// corners, where the chords of a curved sector meet at other angles. On the threads of the current
/// arena. O(elements).
///
/// @returns [nodes], 1: all elements at the node have a least scaled Jacobian of 0.99 or more, no
///          simplex is among them, and one at least is curved
template <class Real>
[[nodiscard]] std::vector<std::uint8_t> find_right_angled(const TopologyView& topology,
                                                          const SurfaceOrientation& orientation,
                                                          std::span<const Vec3<Real>> positions);

}  // namespace meshsmooth::detail
