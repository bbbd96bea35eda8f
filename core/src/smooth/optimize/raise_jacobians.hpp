#pragma once

#include <limits>

#include "mesh/accumulator.hpp"
#include "mesh/measure.hpp"
#include "smooth/base/convergence.hpp"
#include "smooth/optimize/optimize_sweeper.hpp"

namespace meshsmooth::detail {

/// The least value of some elements, and by how much they are below another, together.
struct PoorValues {
  double least = std::numeric_limits<double>::infinity();
  double shortfall = 0;

  friend MESHSMOOTH_HD PoorValues operator+(const PoorValues& a, const PoorValues& b) {
    return {a.least < b.least ? a.least : b.least, a.shortfall + b.shortfall};
  }
};

/// The rule that raises the least scaled Jacobian of a node's ball, which has no gradient where two
/// corners have the same: pattern search. The best of 26 directions is taken at each of several
/// lengths, if it gains and no element becomes invalid that was valid. Source: Hooke, Jeeves 1961,
/// "Direct search solution of numerical and statistical problems".
template <class Real>
struct RaiseVisit {
  static constexpr int kLengths = 5;        // each half of the one before
  static constexpr double kLongest = 0.25;  // of the shortest edge at the node
  static constexpr double kLeastGain = 1e-5;

  Surroundings around;
  DisplacementLimit<Real> displacement_limit;
  const std::uint8_t* poor;  // by node: whether an element of its ball is
  Vec3<Real>* positions;

  MESHSMOOTH_HD SweepStats operator()(std::size_t node) const {
    const Vec3<Real> before = positions[node];
    if (poor[node] == 0 || around.fixed[node] != 0) return stats_of_move(before, before, false);
    Vec3<Real> at = before;
    double least = least_in_ball(node, at, -std::numeric_limits<double>::infinity());
    double length = kLongest * shortest_edge(node);
    for (int n = 0; n < kLengths; ++n, length /= 2) search(node, length, at, least);
    positions[node] = at;
    return stats_of_move(before, at, false);
  }

  [[nodiscard]] MESHSMOOTH_HD double scaled_jacobian_of(std::size_t e, std::size_t node,
                                                        Vec3<Real> position) const {
    Vec3d corners[kMaxCorners];
    const ElementShape& shape = corners_of(e, node, position, corners);
    if (shape.dimension == 3 && shape.node_count == 4) {
      return finite_measure(measure_tetrahedron(corners).scaled_jacobian);
    }
    const auto get = [&](int n) { return corners[n]; };
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < shape.corner_count; ++k) {
      const double value =
          scaled_jacobian(shape, corner_geometry(shape, k, get, around.reference_of(e)));
      if (!(value >= least)) least = value;
    }
    return finite_measure(least);
  }

 private:
  MESHSMOOTH_HD const ElementShape& corners_of(std::size_t e, std::size_t node, Vec3<Real> position,
                                               Vec3d* corners) const {
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) {
      const auto id = static_cast<std::size_t>(element.nodes[n]);
      corners[n] = vec3_cast<double>(id == node ? position : positions[id]);
    }
    return *element.shape;
  }
  /// Any value of at most `enough` where that is reached.
  [[nodiscard]] MESHSMOOTH_HD double least_in_ball(std::size_t node, Vec3<Real> position,
                                                   double enough) const {
    double least = std::numeric_limits<double>::infinity();
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end && least > enough; ++e) {
      const double value = scaled_jacobian_of(*e, node, position);
      if (value < least) least = value;
    }
    return least;
  }
  [[nodiscard]] MESHSMOOTH_HD double shortest_edge(std::size_t node) const {
    double squared = std::numeric_limits<double>::infinity();
    const Vec3d own = vec3_cast<double>(positions[node]);
    const NodeId* const end = around.rings.end(node);
    for (const NodeId* n = around.rings.begin(node); n < end; ++n) {
      const Vec3d way = vec3_cast<double>(positions[*n]) - own;
      const double found = dot(way, way);
      if (found < squared) squared = found;
    }
    return squared < std::numeric_limits<double>::infinity() ? std::sqrt(squared) : 0;
  }
  MESHSMOOTH_HD void search(std::size_t node, double length, Vec3<Real>& at, double& least) const {
    const Vec3<Real> from = at;
    double most = least + kLeastGain;
    for (int n = 0; n < 27; ++n) {
      Vec3d way{static_cast<double>(n % 3 - 1), static_cast<double>(n / 3 % 3 - 1),
                static_cast<double>(n / 9 - 1)};
      // Of a plane mesh in its plane; on other surfaces nodes have constraints.
      if (around.references == nullptr) way = way - dot(way, around.reference) * around.reference;
      const double norm_of_way = norm(way);
      if (!(norm_of_way > 0.1)) continue;
      const Vec3d to = vec3_cast<double>(from) + (length / norm_of_way) * way;
      const Vec3<Real> candidate = project(around, displacement_limit, node, vec3_cast<Real>(to));
      const double found = least_in_ball(node, candidate, most);
      if (!(found > most) || !is_allowed(node, candidate)) continue;
      most = least = found;
      at = candidate;
    }
  }
  [[nodiscard]] MESHSMOOTH_HD bool is_allowed(std::size_t node, Vec3<Real> position) const {
    if (!keeps_facets(SingleThread{}, around.sliding, QuietPositions<Real>{positions}, node,
                      position)) {
      return false;
    }
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end; ++e) {
      if (!is_certain(*e, node, position) && is_certain(*e, node, positions[node])) return false;
    }
    return true;
  }
  /// Whether an element is valid for certain.
  [[nodiscard]] MESHSMOOTH_HD bool is_certain(std::size_t e, std::size_t node,
                                              Vec3<Real> position) const {
    Vec3d corners[kMaxCorners];
    const ElementShape& shape = corners_of(e, node, position, corners);
    const ElementMeasure measure = measure_element(shape, corners, around.reference_of(e));
    return !measure.inverted && !measure.degenerate;
  }
};

/// Raises the least scaled Jacobian of the elements that may move, and those of others that are
/// poor or nearly as low: sweeps in place over the nodes of these, until neither the least one nor
/// all of them rise by much.
///
/// returns  true when the job goes on
/// cost     a sweep: two values per element, and for the nodes of poor elements 130 of their balls
/// order    deterministic
template <Executor E, class Real>
bool raise_jacobians(E& executor, OptimizeSweeper<E, Real>& sweeper, ConvergenceMonitor& monitor) {
  constexpr double kPoor = 0.3;
  constexpr double kBand = 0.1;       // above the least one
  constexpr double kProgress = 1e-3;  // of the least one
  constexpr double kShare = 0.99;     // of the shortfall that progress leaves at most
  constexpr int kPatience = 5;        // sweeps without progress
  const Surroundings around = sweeper.around();
  std::uint8_t* const poor = sweeper.states();
  const RaiseVisit<Real> visit{around, sweeper.displacement_limit(), poor, sweeper.positions()};
  const auto value_of = [=] MESHSMOOTH_HD(std::size_t e) {
    return visit.scaled_jacobian_of(e, around.node_count, Vec3<Real>{});
  };
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
          const double value = value_of(e);
          return PoorValues{value, value < below ? below - value : 0};
        },
        Plus{});
  };
  const auto bound = [](double least) { return least + kBand > kPoor ? least + kBand : kPoor; };
  double below = bound(find_poor(kPoor).least);
  PoorValues reached = find_poor(below);
  for (int standing = 0; standing < kPatience;) {
    if (monitor.sweeps_left() == 0) return !monitor.end(StopReason::iteration_limit);
    executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t n) { poor[n] = 0; });
    executor.for_each(around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
      if (!(value_of(e) < below)) return;
      const ElementView element = around.elements[e];
      for (int n = 0; n < element.shape->node_count; ++n) {
        E::store(poor[element.nodes[n]], std::uint8_t{1});
      }
    });
    const SweepStats stats = reduce_by_colour<SweepStats>(
        executor, sweeper.colouring(), visit, Lookahead<Real>{around, sweeper.positions(), true});
    monitor.record(stats);
    if (monitor.interrupted()) return false;
    if (stats.moved == 0) return true;
    const PoorValues now = find_poor(below);
    const bool progress =
        now.least > reached.least + kProgress || now.shortfall < kShare * reached.shortfall;
    standing = progress ? 0 : standing + 1;
    if (!progress) continue;
    below = bound(now.least);
    reached = find_poor(below);
  }
  return true;
}

}  // namespace meshsmooth::detail
