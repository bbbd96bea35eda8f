#pragma once

#include "smooth/averaging/means.hpp"
#include "smooth/guard/limit_moves.hpp"

namespace meshsmooth::detail {

/// One step of Jacobi form for a node: towards the mean of its neighbours, or past it.
template <class Mean, class Real>
struct LaplacianStep {
  static constexpr int kPhases = 1;
  Mean mean;
  Real factor;

  /// Reads `in.before`, writes `in.after` of a free node.
  template <class In>
  MESHSMOOTH_HD void operator()(int, const In& in, std::size_t node) const {
    const QuietPositions<Real> x{in.before};
    in.after[node] = project(in.around, in.displacement_limit, node,
                             step_towards(mean, in.around, x, node, factor));
  }
};

/// One step of the HC algorithm, in two phases. Source: Vollmer et al. 1999, section 4:
/// p = mean(q); b = p - (alpha o + (1 - alpha) q); p -= beta b + (1 - beta) mean(b).
template <class Real>
struct HcStep {
  static constexpr int kPhases = 2;
  Real alpha, beta;
  const Vec3<Real>* original;  // the input positions
  Vec3<Real>* differences;     // scratch, for each node

  /// The first phase is for all nodes, the second for free ones.
  template <class In>
  MESHSMOOTH_HD void operator()(int phase, const In& in, std::size_t node) const {
    const QuietPositions<Real> x{in.before};
    if (phase == 0) {
      const bool fixed = in.around.fixed[node] != 0;
      const Vec3<Real> mean = fixed ? x[node] : UniformMean{}(in.around, x, node);
      differences[node] = mean - (alpha * original[node] + (1 - alpha) * x[node]);
      if (!fixed) in.after[node] = mean;
      return;
    }
    const QuietPositions<Real> b{differences};
    in.after[node] = project(in.around, in.displacement_limit, node,
                             in.after[node] - (beta * differences[node] +
                                               (1 - beta) * UniformMean{}(in.around, b, node)));
  }
};

/// What a step reads and writes.
template <class Real>
struct StepPositions {
  Surroundings around;
  DisplacementLimit<Real> displacement_limit;
  const Vec3<Real>* before;
  Vec3<Real>* after;
};

/// A step of Jacobi form for all nodes: reads `before`, writes `after`; they agree on fixed nodes.
/// cost   O(ring entries) a phase; when the acceptance is active also limit_moves
template <Executor E, class Step, class Real>
SweepStats sweep_jacobi(E& executor, const SweepContext<E, Real>& context, const Step& step,
                        const Vec3<Real>* before, Vec3<Real>* after) {
  const StepPositions<Real> in{context.around, context.displacement_limit, before, after};
  for (int phase = 0; phase + 1 < Step::kPhases; ++phase) {
    executor.for_each(in.around.node_count,
                      [=] MESHSMOOTH_HD(std::size_t node) { step(phase, in, node); });
  }
  const auto move = [=] MESHSMOOTH_HD(std::size_t node) {
    if (in.around.fixed[node] != 0) return SweepStats{};
    step(Step::kPhases - 1, in, node);
    return stats_of_move(in.before[node], in.after[node], false);
  };
  if (!context.acceptance.active())
    return executor.reduce(in.around.node_count, SweepStats{}, move, Plus{});
  executor.for_each(in.around.node_count, [=] MESHSMOOTH_HD(std::size_t node) { move(node); });
  return limit_moves(executor, context, before, after);
}

/// The new position of a node that moves alone.
template <class Team, class Mean, class P>
MESHSMOOTH_HD Vec3<typename P::Real> move_node(const Team& team, const Surroundings& around,
                                               const P& x, std::size_t node,
                                               const LaplacianStep<Mean, typename P::Real>& step,
                                               const MoveRule<typename P::Real>& rule, bool& held) {
  Vec3<typename P::Real> position = step_towards(step.mean, around, x, node, step.factor);
  // Where the compiler knows that no node slides, it drops this code.
  if (rule.acceptance.facets || rule.displacement_limit.home != nullptr)
    position = project(around, rule.displacement_limit, node, position);
  return rule.acceptance.active() ? accept_move(team, around, x, node, position, rule, held)
                                  : position;
}

/// Deterministic Gauss-Seidel: in place, colour by colour.
template <Executor E, class Mean, class Real>
SweepStats sweep_gauss_seidel(E& executor, const SweepContext<E, Real>& context, const Mean& mean,
                              Real factor, Vec3<Real>* positions) {
  const Surroundings& around = context.around;
  const MoveRule<Real> rule{context.acceptance, context.displacement_limit};
  const LaplacianStep<Mean, Real> step{mean, factor};
  const QuietPositions<Real> x{positions};
  const auto visit = [=] MESHSMOOTH_HD(std::size_t node) {
    bool held = false;
    const Vec3<Real> before = x[node];
    const Vec3<Real> position = move_node(typename E::Thread{}, around, x, node, step, rule, held);
    positions[node] = position;
    return stats_of_move(before, position, held);
  };
  return reduce_by_colour<SweepStats>(
      executor, *context.colouring, visit,
      Lookahead<Real>{around, positions, context.acceptance.active() || Mean::reads_balls});
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

}  // namespace meshsmooth::detail
