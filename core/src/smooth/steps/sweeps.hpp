#pragma once

#include "smooth/rules/means.hpp"
#include "smooth/steps/limit_moves.hpp"

namespace meshsmooth::detail {

/// Jacobi: reads `before`, writes `after`; they agree on fixed nodes.
/// cost   O(ring entries); when the acceptance is active also limit_moves
template <Executor E, class Mean, class Real>
SweepStats sweep_jacobi(E& executor, const SweepContext<E, Real>& context, const Mean& mean,
                        Real factor, const Vec3<Real>* before, Vec3<Real>* after) {
  const Surroundings& around = context.around;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  const QuietPositions<Real> x{before};
  const auto move = [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return SweepStats{};
    after[node] =
        project(around, displacement_limit, node, step_towards(mean, around, x, node, factor));
    return stats_of_move(before[node], after[node], false);
  };
  if (!context.acceptance.active())
    return executor.reduce(around.node_count, SweepStats{}, move, Plus{});
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) { move(node); });
  return limit_moves(executor, context, before, after);
}

/// The new position of a node that moves alone.
template <class Team, class Mean, class P>
MESHSMOOTH_HD Vec3<typename P::Real> move_node(
    const Team& team, const Surroundings& around, const P& x, std::size_t node, const Mean& mean,
    typename P::Real factor, Acceptance acceptance, bool& held,
    DisplacementLimit<typename P::Real> displacement_limit = {}) {
  Vec3<typename P::Real> position = step_towards(mean, around, x, node, factor);
  // Where the compiler knows that no node slides, it drops this code.
  if (acceptance.facets || displacement_limit.home != nullptr)
    position = project(around, displacement_limit, node, position);
  return acceptance.active()
             ? accept_move(team, around, x, node, position, acceptance, held, displacement_limit)
             : position;
}

/// Deterministic Gauss-Seidel: in place, colour by colour.
template <Executor E, class Mean, class Real>
SweepStats sweep_gauss_seidel(E& executor, const SweepContext<E, Real>& context, const Mean& mean,
                              Real factor, Vec3<Real>* positions) {
  const Surroundings& around = context.around;
  const Acceptance acceptance = context.acceptance;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  const QuietPositions<Real> x{positions};
  return reduce_by_colour<SweepStats>(
      executor, *context.colouring, [=] MESHSMOOTH_HD(std::size_t node) {
        bool held = false;
        const Vec3<Real> before = x[node];
        const Vec3<Real> position = move_node(typename E::Thread{}, around, x, node, mean, factor,
                                              acceptance, held, displacement_limit);
        positions[node] = position;
        return stats_of_move(before, position, held);
      });
}

/// Asynchronous relaxation: in place, without an order. Not deterministic.
/// An active acceptance evaluates the sweep as a whole; `before` then keeps the positions
/// before it. Source: Xiao et al. 2019, "Form B".
template <Executor E, class Mean, class Real>
SweepStats sweep_asynchronous(E& executor, const SweepContext<E, Real>& context, const Mean& mean,
                              Real factor, Vec3<Real>* before, Vec3<Real>* positions) {
  const Surroundings& around = context.around;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  const bool limited = context.acceptance.active();
  if (limited) copy_positions(executor, around.node_count, positions, before);
  const typename E::template AsynchronousPositions<Real> x{positions};
  const auto move = [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return SweepStats{};
    const Vec3<Real> before_move = x[node];
    const Vec3<Real> position =
        project(around, displacement_limit, node, step_towards(mean, around, x, node, factor));
    x.store(node, position);
    return stats_of_move(before_move, position, false);
  };
  if (!limited) return executor.reduce(around.node_count, SweepStats{}, move, Plus{});
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) { move(node); });
  return limit_moves<E, Real>(executor, context, before, positions);
}

/// Arrays of an HC sweep, node_count each.
template <class Real>
struct HcArrays {
  const Vec3<Real>* original;  // the input positions
  const Vec3<Real>* before;
  Vec3<Real>* after;
  Vec3<Real>* differences;  // scratch
};

/// One sweep of the HC algorithm, Jacobi. Source: Vollmer et al. 1999, section 4: p = mean(q);
/// b = p - (alpha o + (1 - alpha) q); p -= beta b + (1 - beta) mean(b).
template <Executor E, class Real>
SweepStats sweep_hc(E& executor, const SweepContext<E, Real>& context, Real alpha, Real beta,
                    const HcArrays<Real>& arrays) {
  const Surroundings& around = context.around;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  const Vec3<Real>* const original = arrays.original;
  const Vec3<Real>* const before = arrays.before;
  Vec3<Real>* const after = arrays.after;
  Vec3<Real>* const differences = arrays.differences;
  const QuietPositions<Real> x{before};
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const bool fixed = around.fixed[node] != 0;
    const Vec3<Real> mean = fixed ? before[node] : UniformMean{}(around, x, node);
    differences[node] = mean - (alpha * original[node] + (1 - alpha) * before[node]);
    if (!fixed) after[node] = mean;
  });
  const QuietPositions<Real> b{differences};
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return;
    after[node] = project(
        around, displacement_limit, node,
        after[node] - (beta * differences[node] + (1 - beta) * UniformMean{}(around, b, node)));
  });
  if (!context.acceptance.active()) {
    return measure_moves(executor, around.node_count, before, after);
  }
  return limit_moves(executor, context, before, after);
}

}  // namespace meshsmooth::detail
