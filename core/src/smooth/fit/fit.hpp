#pragma once

#include "smooth/constraints/constrain.hpp"
#include "smooth/guard/limit_moves.hpp"
#include "smooth/optimize/optimize.hpp"

namespace meshsmooth::detail {

/// How nodes that belong on a surface lie off it.
struct OffSurface {
  double largest = 0;
  double sum = 0;
  std::int64_t nodes = 0;  // with a place on it
  std::int64_t off = 0;    // of these, marked as off their target

  friend MESHSMOOTH_HD OffSurface operator+(const OffSurface& a, const OffSurface& b) {
    return {a.largest > b.largest ? a.largest : b.largest, a.sum + b.sum, a.nodes + b.nodes,
            a.off + b.off};
  }
  [[nodiscard]] SurfaceDistance distance() const {
    return {largest, nodes == 0 ? 0 : sum / static_cast<double>(nodes)};
  }
};

/// cost   O(nodes with a target * log triangles)
template <Executor E, class Real>
OffSurface measure_off_surface(E& executor, std::size_t node_count,
                               const SlidingConstraints& sliding, const Vec3<Real>* positions) {
  return executor.reduce(
      node_count, OffSurface{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const NodeConstraint* const constraint = sliding.constraint(node);
        if (constraint == nullptr || constraint->target < 0) return OffSurface{};
        const Vec3d p = vec3_cast<double>(positions[node]);
        const double off = norm(closest_on_entity(sliding.surface, constraint->target, p) - p);
        return OffSurface{off, off, 1, constraint->off_target ? 1 : 0};
      },
      Plus{});
}

/// Moves the nodes that are off their targets straight there, as far as elements stay valid; marks
/// those that have arrived.
///
/// takes  two arrays of positions to work in; the constraints of the context's surroundings
/// cost   O(elements + nodes off * log triangles)
template <Executor E, class Real>
void step_to_surface(E& executor, const SweepContext<E, Real>& context,
                     NodeConstraint* node_constraints, Vec3<Real>* goals, Vec3<Real>* moved,
                     Vec3<Real>* positions) {
  const std::size_t n = context.around.node_count;
  const SlidingConstraints sliding = context.around.sliding;
  const DisplacementLimit<Real> limit = context.displacement_limit;
  executor.for_each(n, [=] MESHSMOOTH_HD(std::size_t node) {
    const NodeConstraint* const constraint = sliding.constraint(node);
    goals[node] = moved[node] = positions[node];
    if (constraint == nullptr || constraint->target < 0 || !constraint->off_target) return;
    const Vec3d p = vec3_cast<double>(positions[node]);
    goals[node] = vec3_cast<Real>(closest_on_entity(sliding.surface, constraint->target, p));
    moved[node] = limit.clamp(node, goals[node]);
  });
  SweepContext<E, Real> guarded = context;
  guarded.acceptance = {.guard = context.acceptance.guard};
  guarded.suspects = nullptr;
  limit_moves<E, Real>(executor, guarded, positions, moved);
  executor.for_each(n, [=] MESHSMOOTH_HD(std::size_t node) {
    positions[node] = moved[node];
    const NodeConstraint* const constraint = sliding.constraint(node);
    if (constraint == nullptr || constraint->target < 0 || !constraint->off_target) return;
    if (moved[node] == goals[node]) node_constraints[sliding.slots[node]].off_target = false;
  });
}

/// Marks the nodes that lie farther from their targets than `tolerance` as off them.
template <Executor E, class Real>
void mark_off_surface(E& executor, std::size_t node_count, const SlidingConstraints& sliding,
                      double tolerance, const Vec3<Real>* positions,
                      NodeConstraint* node_constraints) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const NodeConstraint* const constraint = sliding.constraint(node);
    if (constraint == nullptr || constraint->target < 0) return;
    const Vec3d p = vec3_cast<double>(positions[node]);
    const double off = norm(closest_on_entity(sliding.surface, constraint->target, p) - p);
    if (off > tolerance) node_constraints[sliding.slots[node]].off_target = true;
  });
}

/// What a job with a target surface fills.
struct FitTask {
  NodeConstraint* node_constraints;  // those of the surroundings
  double tolerance;                  // how far off its target a node may lie
  double box_diagonal;
  FitStats& stats;
};

/// Brings the nodes of the boundary onto their targets: all that are off go straight there, as far
/// as elements stay valid (`limit_moves`); then sweeps make room for the next step, in which those
/// that have arrived slide. Ends when all have arrived, or steps bring them no nearer. Then the
/// mesh is optimized with nodes sliding.
///
/// cost   a step: O(elements), and a coarse run of the optimizer; `fit_bytes`
template <OptimizingBackend B, class Real>
class SurfaceFit {
 public:
  using E = typename B::Executor;

  SurfaceFit(B& backend, const SweepContext<E, Real>& context, const FitTask& task,
             Vec3<Real>* positions)
      : executor_(backend.executor()),
        context_(context),
        task_(task),
        positions_(positions),
        goals_(allocate()),
        moved_(allocate()) {}

  /// Moves nothing.
  void evaluate() {
    report_input(measure());
    report_result();
  }

  /// Without `sweeps`, which no node may need, steps are all.
  void run(Optimizer<B, Real>& optimizer, const CallerPositions<Real>& given, bool sweeps) {
    FitStats& stats = task_.stats;
    OffSurface off = measure();
    report_input(off);
    int standing = 0;
    while (standing < kStanding && stats.step_count < kMostSteps) {
      const OffSurface before = off;
      step();
      ++stats.step_count;
      off = measure();
      if (off.off == 0 || !sweeps) break;
      standing = off.sum > kProgress * before.sum && off.off >= before.off ? standing + 1 : 0;
      optimizer.run({.tolerance = kCoarse});
      if (optimizer.job_ended()) break;
    }
    const auto optimize = [&] {
      if (!sweeps || optimizer.job_ended()) return;
      optimizer.run({.given = stats.input_off_surface ? nullptr : &given});
    };
    optimize();
    if (off.off > 0 && sweeps && !optimizer.job_ended()) {
      step();
      ++stats.step_count;
      optimize();
    }
    if (context_.acceptance.guard) undo_inversions(given);
    report_result();
  }

 private:
  static constexpr double kNear = 1e-6;      // of the diagonal: nodes that count as arrived
  static constexpr double kProgress = 0.99;  // a step that leaves more of the distances stands
  static constexpr int kStanding = 3;        // steps
  static constexpr int kMostSteps = 60;
  static constexpr double kCoarse = 100;  // times the tolerance

  [[nodiscard]] auto allocate() {
    return executor_.template allocate<Vec3<Real>>(context_.around.node_count);
  }

  [[nodiscard]] OffSurface measure() {
    return measure_off_surface(executor_, context_.around.node_count, context_.around.sliding,
                               static_cast<const Vec3<Real>*>(positions_));
  }

  void report_input(const OffSurface& off) {
    task_.stats.input_to_surface = off.distance();
    task_.stats.input_off_surface = off.largest > kNear * task_.box_diagonal;
  }
  void report_result() {
    const OffSurface off = measure();
    task_.stats.result_to_surface = off.distance();
    task_.stats.held_count = off.off;
    task_.stats.reached_count = off.nodes - off.off;
  }

  void step() {
    step_to_surface(executor_, context_, task_.node_constraints, goals_.data(), moved_.data(),
                    positions_);
  }

  /// Where the mesh stays tangled: undoes moves that inverted an element which was valid in the
  /// input. Nodes that leave their targets by that go back there as far as elements stay valid.
  void undo_inversions(const CallerPositions<Real>& given) {
    const std::size_t n = context_.around.node_count;
    const auto before = positions_in_order(executor_, given.positions, given.caller_ids, n);
    SweepContext<E, Real> guarded = context_;
    guarded.acceptance = {.guard = true};
    guarded.suspects = nullptr;
    guarded.displacement_limit = {};
    const SweepStats undone = limit_moves<E, Real>(executor_, guarded, before.data(), positions_);
    if (undone.held == 0) return;
    mark_off_surface(executor_, n, context_.around.sliding, task_.tolerance, positions_,
                     task_.node_constraints);
    step();
  }

  E& executor_;
  const SweepContext<E, Real>& context_;
  const FitTask& task_;
  Vec3<Real>* positions_;
  typename E::template Buffer<Vec3<Real>> goals_;
  typename E::template Buffer<Vec3<Real>> moved_;
};

/// `optimize` with nodes that slide on a target surface and are brought there first.
template <OptimizingBackend B, class Real>
void fit_to_surface(B& backend, const SweepContext<typename B::Executor, Real>& context,
                    const Optimize& method, ConvergenceMonitor& monitor,
                    const CallerPositions<Real>& given, const FitTask& task,
                    Vec3<Real>* positions) {
  Optimizer<B, Real> optimizer(backend, context, method, monitor, positions);
  SurfaceFit<B, Real> fit(backend, context, task, positions);
  if (monitor.plan().iteration_limit == 0) {
    fit.evaluate();
  } else {
    fit.run(optimizer, given, !monitor.done_at_once());
  }
  optimizer.report();
}

}  // namespace meshsmooth::detail
