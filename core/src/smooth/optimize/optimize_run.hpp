#pragma once

#include "smooth/base/positions.hpp"
#include "smooth/optimize/phase_monitor.hpp"

namespace meshsmooth::detail {

/// Balls with a worst mean ratio below are refined when no target is given.
inline constexpr double kPoorMeanRatio = 0.5;
/// The refinement phases: norms that approach the maximum norm. A step along the gradient of the
/// worst corner of each ball stops earlier, where no single node can improve it.
inline constexpr int kRefinementPowers[] = {8, 16, 32};
/// The power of what raises the worst elements of a whole mesh: of hubs by 8 to 28 %, their means
/// by 0 to 2 %. From the optimum of the goal on: in its place, layers lost 5 % of their heights.
inline constexpr int kRaisingPower = 8;

/// The caller's positions, in executor memory.
template <class Real>
struct CallerPositions {
  const Vec3<Real>* positions;  // in the caller's order
  const NodeId* caller_ids;     // of a node of ours
};

/// What a run of the optimizer does besides the options.
template <class Real>
struct OptimizeRun {
  /// Where moves that inverted a valid element are undone from, if the mesh stays tangled; null:
  /// they are not.
  const CallerPositions<Real>* given = nullptr;
  double tolerance = 1;                  // times that of the options
  int repairs = PhaseMonitor::kNoLimit;  // most sweeps that untangle at last; else it gives up
  bool softens = true;                   // what repair leaves tangled
  /// Above 0: global steps take the place of acceleration, and this is how many entries the rings
  /// have.
  std::size_t ring_entries = 0;
  bool precise = true;  // goes on where a long error, or one of a few nodes, is nearly gone
  bool raises = false;  // the worst elements at last
};

}  // namespace meshsmooth::detail
