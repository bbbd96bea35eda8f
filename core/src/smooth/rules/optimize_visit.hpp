#pragma once

#include <cmath>

#include "smooth/rules/optimize_rule.hpp"
#include "smooth/rules/sweep_stats.hpp"

namespace meshsmooth::detail {

/// What one sweep of visits did.
struct OptimizeStats {
  SweepStats moves;
  double gain = 0;           // sum over the nodes of `Visit::gain`
  std::int64_t tangled = 0;  // balls not valid after their visit

  friend MESHSMOOTH_HD OptimizeStats operator+(const OptimizeStats& a, const OptimizeStats& b) {
    return {a.moves + b.moves, a.gain + b.gain, a.tangled + b.tangled};
  }
};

/// When a run of sweeps ends by the statistics of the last one; evaluated on the device too.
struct PhaseEnd {
  bool when_untangled = false;  // no tangled ball is left
  double least_gain = 0;        // the sweep's gain is below
  double least_move = 0;        // the largest move is below, in the mesh's unit

  [[nodiscard]] MESHSMOOTH_HD bool after(const OptimizeStats& stats) const {
    return stats.moves.moved == 0 || (when_untangled && stats.tangled == 0) ||
           stats.gain < least_gain || std::sqrt(stats.moves.max_squared) < least_move;
  }
};

/// What a node's next visit needs to know of its last one, as bits.
///
/// A node whose surroundings are as at its last visit, when it did not move, would not move
/// again: it is asleep and skipped, which changes no bit of the result. A node that moves wakes
/// all nodes that share an element with it.
enum VisitState : std::uint8_t {
  kAwake = 1,  // it, or a node around it, has moved since
  kTangledBall = 2,
  kHeldNode = 4,  // a move was rejected
};

/// What a sleeping node adds to the statistics of a sweep.
MESHSMOOTH_HD inline OptimizeStats stats_asleep(std::uint8_t state) {
  return {{0, 0, 0, (state & kHeldNode) != 0 ? 1 : 0}, 0, (state & kTangledBall) != 0 ? 1 : 0};
}

/// What a visit adds to them.
template <class Real>
MESHSMOOTH_HD OptimizeStats stats_of_visit(Vec3<Real> before, const Visit<Real>& visit) {
  return {stats_of_move(before, visit.position, visit.held), visit.gain, visit.tangled ? 1 : 0};
}

/// A node's state after a visit.
template <class Real>
MESHSMOOTH_HD std::uint8_t state_after(Vec3<Real> before, const Visit<Real>& visit) {
  return static_cast<std::uint8_t>((visit.position == before ? 0 : kAwake) |
                                   (visit.tangled ? kTangledBall : 0) |
                                   (visit.held ? kHeldNode : 0));
}

}  // namespace meshsmooth::detail
