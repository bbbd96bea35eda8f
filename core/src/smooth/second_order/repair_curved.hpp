#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"
#include "meshsmooth/smoother.hpp"
#include "smooth/base/displacement.hpp"

namespace meshsmooth::detail {

/// What a repair is for.
enum class RepairGoal : std::uint8_t {
  validity,      // invalid elements: their nodes and those of rings around them
  shape,         // distorted ones: their nodes; the worst coefficient at a node never gets worse
  worst_shapes,  // the same of those that are far more distorted
};

/// What a repair may move.
template <class Real>
struct RepairScope {
  std::vector<std::uint8_t> held;      // [nodes], not 0: stays
  DisplacementLimit<Real> limit = {};  // of the other ones
  int rings = 2;                       // around invalid elements
};

/// Moves nodes of elements of second order until the elements are valid, or none is distorted, or
/// no visit helps. Nodes take turns, colour by colour; each lowers the `CoefficientEnergy` of the
/// Bézier coefficients of the Jacobian in the elements at it, which are linear in its position. A
/// curved element is distorted where one of them is below 0.85 or above 1 / 0.85 of their mean, far
/// more where that is 0.65. An element that is valid stays so; nodes of the boundary and between
/// regions stay where they are.
///
/// Source of h: Escobar et al. 2003, "Simultaneous untangling and smoothing of tetrahedral meshes";
/// of the measure and of barriers that move with the worst coefficient: Toulorge, Geuzaine,
/// Remacle, Lambrechts 2013, "Robust untangling of curvilinear meshes".
///
/// takes  `goes_on`: asked every few visits, false ends with what is reached, and it may throw
/// cost   about 15 us a visit of a node among tetrahedra, on all threads; at most 60 sweeps
/// order  deterministic
/// gives  `positions`
/// @returns the bytes that it held at most
template <class Real>
std::int64_t repair_curved(RepairGoal goal, const TopologyView& topology,
                           const RepairScope<Real>& scope, const SurfaceOrientation& orientation,
                           std::span<Vec3<Real>> positions, const std::function<bool()>& goes_on);

/// @returns an upper bound of what `repair_curved` holds on a mesh of this size, reached where all
/// of it is repaired; 0 for a linear one
[[nodiscard]] std::int64_t repair_bytes(const MeshSize& size);

}  // namespace meshsmooth::detail
