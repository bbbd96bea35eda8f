#pragma once

#include <limits>

#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/optimize_sweeper.hpp"
#include "smooth/optimize/raise_visit.hpp"

namespace meshsmooth::detail {

/// The least value of some elements, and by how much they are below another, together.
struct PoorValues {
  double least = std::numeric_limits<double>::infinity();
  double shortfall = 0;

  friend MESHSMOOTH_HD PoorValues operator+(const PoorValues& a, const PoorValues& b) {
    return {a.least < b.least ? a.least : b.least, a.shortfall + b.shortfall};
  }
};

/// Moves nodes back to where they began until no element that may move has a lower scaled Jacobian
/// than the least there.
///
/// cost   `restore_below`
template <Executor E, class Real>
void restore_jacobians(E& executor, OptimizeSweeper<E, Real>& sweeper, const Vec3<Real>* before) {
  const Surroundings around = sweeper.around();
  std::uint8_t* const marks = sweeper.states();
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t n) { marks[n] = 0; });
  Restoring<E, Real> rules{around, QualityMetric::scaled_jacobian, before, sweeper.positions(),
                           marks};
  rules.floor = measure_change(executor, rules).floor.of(rules.metric).lowered();
  restore_below(executor, rules);
}

/// Raises the least scaled Jacobian of the elements that may move, and those of others that are
/// poor or nearly as low: sweeps in place over the nodes of these, with a higher power at the end,
/// until neither the least one nor all of them rise by much.
///
/// returns  true when the job goes on
/// cost     a sweep: two values per element, and `RaiseVisit` at the nodes of poor elements
/// order    deterministic
template <Executor E, class Real>
bool raise_jacobians(E& executor, OptimizeSweeper<E, Real>& sweeper, ConvergenceMonitor& monitor) {
  constexpr double kPoor = 0.3;
  constexpr double kBand = 0.1;       // above the least one
  constexpr double kProgress = 1e-3;  // of the least one
  constexpr double kShare = 0.98;     // of the shortfall that progress leaves at most
  constexpr int kPatience = 4;        // sweeps without progress
  const Surroundings around = sweeper.around();
  std::uint8_t* const poor = sweeper.states();
  RaiseVisit<Real> visit{around, sweeper.displacement_limit(), poor, sweeper.positions()};
  const auto find_poor = [&](double below) {
    return executor.reduce(
        around.elements.count, PoorValues{},
        [=] MESHSMOOTH_HD(std::size_t e) {
          const ElementView element = around.elements[e];
          bool may_move = false;
          for (int n = 0; n < element.shape->node_count; ++n) {
            may_move = may_move || around.fixed[element.nodes[n]] == 0;
          }
          if (!may_move) return PoorValues{};
          const double value = visit.scaled_jacobian_of(e);
          return PoorValues{value, value < below ? below - value : 0};
        },
        Plus{});
  };
  const auto look = [&] {
    const double least = find_poor(0).least;
    visit.least = least;
    visit.below = least + kBand > kPoor ? least + kBand : kPoor;
    return find_poor(visit.below);
  };
  for (const int power : {4, 12}) {
    visit.power = power;
    PoorValues reached = look();
    for (int standing = 0; standing < kPatience;) {
      if (monitor.sweeps_left() == 0) return !monitor.end(StopReason::iteration_limit);
      executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t n) { poor[n] = 0; });
      executor.for_each(around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
        if (!(visit.scaled_jacobian_of(e) < visit.below)) return;
        const ElementView element = around.elements[e];
        for (int n = 0; n < element.shape->node_count; ++n) {
          E::store(poor[element.nodes[n]], std::uint8_t{1});
        }
      });
      const SweepStats stats = reduce_by_colour<SweepStats>(
          executor, sweeper.colouring(), visit, Lookahead<Real>{around, sweeper.positions(), true});
      monitor.record(stats);
      if (monitor.interrupted()) return false;
      if (stats.moved == 0) break;
      const PoorValues now = find_poor(visit.below);
      const bool progress =
          now.least > reached.least + kProgress || now.shortfall < kShare * reached.shortfall;
      standing = progress ? 0 : standing + 1;
      if (progress) reached = look();
    }
  }
  return true;
}

}  // namespace meshsmooth::detail
