#pragma once

#include <cmath>

#include "smooth/base/sweep_stats.hpp"
#include "smooth/optimize/optimize_rule.hpp"

namespace meshsmooth::detail {

/// What one sweep of visits did.
struct OptimizeStats {
  SweepStats moves;
  double gain = 0;           // sum over the nodes of `Visit::gain`
  double squared_gain = 0;   // sum of its squares
  double depth = 0;          // sum over the tangled balls of `Visit::depth`
  std::int64_t tangled = 0;  // balls not valid after their visit

  friend MESHSMOOTH_HD OptimizeStats operator+(const OptimizeStats& a, const OptimizeStats& b) {
    return {a.moves + b.moves, a.gain + b.gain, a.squared_gain + b.squared_gain, a.depth + b.depth,
            a.tangled + b.tangled};
  }
};

/// When a run of sweeps ends by the statistics of the last two; evaluated on the device too.
/// Gains are shared among the nodes that still move, so a defect counts no less in a large mesh
/// than in a small one.
struct PhaseEnd {
  bool when_untangled = false;  // no tangled ball is left
  double least_gain = 0;        // the mean gain is below, tangled balls or not
  double tolerance = 0;         // of `settled`; 0: never
  double free_count = 0;        // nodes that may move
  double least_move = 0;        // the largest move is below, in the mesh's unit

  /// Whether the descent is nearly done: a sweep lowers the energy of a ball whose node still moves
  /// by less than the tolerance in the mean; with every gain weighted by itself, which finds a few
  /// bad balls among many good ones, by less than ten times it; and all sweeps to come together, if
  /// their gains go on falling as the last two, by less than five times it. A tenth of the
  /// tolerance applies once most nodes are at rest: the others are worth it, as their sweeps are
  /// cheap.
  [[nodiscard]] MESHSMOOTH_HD bool settled(const OptimizeStats& stats, double gain_before) const {
    const auto moved = static_cast<double>(stats.moves.moved);
    const double allowed = moved < 0.5 * free_count ? 0.1 * tolerance : tolerance;
    const double bound = allowed * moved;
    return stats.gain < bound && stats.squared_gain < 10 * allowed * stats.gain &&
           remaining_gain(stats.gain, gain_before) < 5 * bound;
  }

  /// The sum of the geometric series that continues two gains.
  [[nodiscard]] static MESHSMOOTH_HD double remaining_gain(double gain, double gain_before) {
    return gain < gain_before ? gain * gain / (gain_before - gain) : HUGE_VAL;
  }

  [[nodiscard]] MESHSMOOTH_HD bool after(const OptimizeStats& stats, double gain_before) const {
    if (stats.moves.moved == 0 || std::sqrt(stats.moves.max_squared) < least_move) return true;
    if (stats.gain < least_gain * static_cast<double>(stats.moves.moved)) return true;
    if (stats.tangled > 0) return false;
    return when_untangled || settled(stats, gain_before);
  }
};

/// What a node's next visit needs to know of its last one, as bits.
///
/// A node whose surroundings are as at its last visit, when it did not move, would not move
/// again: it is asleep and skipped, which changes no bit of the result. A node that moves wakes
/// all nodes that share an element with it.
enum VisitState : std::uint8_t {
  kAwake = 1,     // it, or a node around it, has moved since; or its ball is tangled
  kHeldNode = 2,  // a move was rejected
};

/// What a sleeping node adds to the statistics of a sweep.
MESHSMOOTH_HD inline OptimizeStats stats_asleep(std::uint8_t state) {
  return {.moves = {0, 0, 0, (state & kHeldNode) != 0 ? 1 : 0}};
}

/// What a visit adds to them.
template <class Real>
MESHSMOOTH_HD OptimizeStats stats_of_visit(Vec3<Real> before, const Visit<Real>& visit) {
  return {stats_of_move(before, visit.position, visit.held), visit.gain, visit.gain * visit.gain,
          visit.depth, visit.tangled ? 1 : 0};
}

/// A node's state after a visit.
template <class Real>
MESHSMOOTH_HD std::uint8_t state_after(Vec3<Real> before, const Visit<Real>& visit) {
  return static_cast<std::uint8_t>((visit.position == before && !visit.tangled ? 0 : kAwake) |
                                   (visit.held ? kHeldNode : 0));
}

}  // namespace meshsmooth::detail
