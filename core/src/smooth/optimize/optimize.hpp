#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "smooth/guard/limit_moves.hpp"
#include "smooth/optimize/anderson.hpp"
#include "smooth/optimize/global_steps.hpp"
#include "smooth/optimize/optimize_bytes.hpp"
#include "smooth/optimize/optimize_run.hpp"
#include "smooth/optimize/optimizing_backend.hpp"
#include "smooth/optimize/poor_elements.hpp"
#include "smooth/optimize/raise_jacobians.hpp"

namespace meshsmooth::detail {

/// The method Optimize: untangles where a ball is not valid, then descends the goal's energy,
/// then refines poor balls by high powers for Goal::worst.
///
/// Errors that are short or few are gone after some sweeps of each phase. Untangling
/// what is left then needs many nodes to move at once. Tangled meshes are then softened
/// (see `soften`), also those that are valid but nearly flat somewhere, and the descent is
/// accelerated.
template <OptimizingBackend B, class Real>
class Optimizer {
 public:
  using E = typename B::Executor;

  Optimizer(B& backend, const SweepContext<E, Real>& context, const Optimize& method,
            ConvergenceMonitor& monitor, Vec3<Real>* positions)
      : backend_(backend),
        executor_(backend.executor()),
        context_(context),
        method_(method),
        monitor_(monitor),
        plan_(monitor.plan()),
        opposite_(backend.find_opposite_nodes(context.around)),
        sweeper_(executor_, with_opposite(context, opposite_.data()), positions) {}

  /// May be called again after the positions have changed.
  void run(const OptimizeRun<Real>& run) {
    run_ = run;
    last_ = {};
    far_ = false;
    if (monitor_.done_at_once()) {
      job_ended_ = true;
      return;
    }
    const MeshEnergy start = sweeper_.measure(1);
    job_ended_ = !run_phases(start);
    // Repair checks corners only, and the descent need not cure what it broke between them.
    if (start.invalid > 0 && undoes() && sweeper_.measure(1).invalid > 0) undo_inversions();
  }

  /// Whether a limit or the caller has ended the job.
  [[nodiscard]] bool job_ended() const { return job_ended_; }

  /// After the last run: what holds poor elements, if the options ask for it.
  void report() {
    const std::optional<double>& below = plan_.options.report_below;
    if (below) monitor_.record_poor(explain(*below));
  }

 private:
  /// What holds elements below a quality: a sweep in which only nodes move that gain by it is tried
  /// and undone.
  [[nodiscard]] PoorElements explain(double quality) {
    constexpr double kWorthwhile = 1e-3;  // decrement
    const Saved saved = save();
    const JobPlan once = plan_job({.max_iterations = 1});
    const JobControl nobody;
    ConvergenceMonitor monitor(once, nobody, 0, monitor_.free_count());
    const OptimizePhase phase{.power = power_of(method_.goal),
                              .poor = 1 / quality,
                              .guard = plan_.options.guard,
                              .rest = kWorthwhile};
    PhaseMonitor phase_monitor(monitor, phase, {}, 0);
    if (monitor_.free_count() > 0) {
      sweeper_.wake_all();
      backend_.optimize_phase(sweeper_, phase, phase_monitor);
    }
    const PoorElements poor = count_poor(executor_, context_.around, quality,
                                         saved.positions.data(), sweeper_.positions());
    restore(saved);
    return poor;
  }

  /// True when no limit has ended the job.
  bool run_phases(const MeshEnergy& start) {
    const bool raises = plan_.raises_jacobians && run_.tolerance <= 1;
    std::optional<Saved> valid;
    if (raises && start.invalid == 0) valid.emplace(save());
    if (method_.target_quality > 0 && start.worst >= method_.target_quality) {
      return !monitor_.end(StopReason::target_reached);
    }
    if (start.invalid > 0 && !untangle()) return false;
    if (last_.tangled > 0 && (run_.repairs < PhaseMonitor::kNoLimit || !run_.softens)) {
      end();
      return true;
    }
    const PhaseEnd converged = converged_end();
    if (!descend(converged)) return false;
    if (method_.goal == Goal::worst && !refine(converged)) return false;
    if (run_.raises && last_.tangled == 0 && !raise_worst(converged)) return false;
    if (valid) restore_jacobians(executor_, sweeper_, valid->positions.data());
    if (raises && !raise_jacobians(executor_, sweeper_, monitor_)) return false;
    end();
    return true;
  }

  /// Where to return to.
  struct Saved {
    typename E::template Buffer<Vec3<Real>> positions;
    OptimizeStats last;
  };

  /// From the optimum of `balanced` on: higher powers in all balls, then the highest in poor ones.
  /// True when the job goes on. What it reaches is no worse than `balanced`.
  bool refine(const PhaseEnd& converged) {
    const Saved saved = save();
    const double worst = sweeper_.measure(1).worst;
    bool goes_on = run_phase({.power = 4, .guard = plan_.options.guard}, converged);
    // Few balls are poor, which is no reason to ask more of them; and what high powers gain in
    // many sweeps is little (cube of 10,000 nodes: 0.1 degrees for twice the sweeps).
    PhaseEnd refined = converged;
    refined.free_count = 0;
    refined.tolerance *= 3;
    const double poor = method_.target_quality > 0 ? method_.target_quality : kPoorMeanRatio;
    for (const int power : kRefinementPowers) {
      const OptimizePhase phase{.power = power, .poor = 1 / poor, .guard = plan_.options.guard};
      goes_on = goes_on && run_phase(phase, refined);
    }
    if (sweeper_.measure(1).worst < worst) restore(saved);
    return goes_on;
  }

  /// Descends `kRaisingPower` in all balls; true when the job goes on. By sweeps alone where they
  /// were enough for the goal's energy: what is left to raise then is near its cure too, and global
  /// steps would cost a hundred times as much.
  bool raise_worst(const PhaseEnd& converged) {
    // Global steps are taken in single precision, which higher powers of flat elements exceed.
    constexpr double kLeastRaised = 1e-3;
    if (sweeper_.measure(1).worst < kLeastRaised) return true;
    const OptimizePhase phase = descent(kRaisingPower);
    PhaseMonitor phase_monitor(monitor_, phase, converged, method_.target_quality);
    sweeper_.wake_all();
    if (!run_part(phase_monitor, phase, kSweepsBeforeSteps)) return false;
    return phase_monitor.ended() || !far_ || descend_far(phase, converged);
  }

  /// Ends a job that no limit has ended.
  void end() {
    const SweepStats& moves = last_.moves;
    if (last_.tangled > 0) {
      monitor_.end(StopReason::stagnated, EndRule::no_progress);
    } else if (moves.moved == 0 && moves.held > 0) {
      monitor_.end(StopReason::stagnated, EndRule::all_held);
    } else {
      monitor_.end(StopReason::converged, moves.moved == 0 ? EndRule::at_rest
                                          : plan_.options.tolerance.relative
                                              ? EndRule::small_gains
                                              : EndRule::small_moves);
    }
  }

  /// A valid mesh with a corner below is nearly tangled: its nodes may hold each other there.
  static constexpr double kNearlyFlat = 0.05;

  static SweepContext<E, Real> with_opposite(SweepContext<E, Real> context,
                                             const NodeId* opposite) {
    context.around.opposite = opposite;
    return context;
  }

  [[nodiscard]] PhaseEnd converged_end() const {
    const Tolerance& tolerance = plan_.options.tolerance;
    return {.tolerance = tolerance.relative ? run_.tolerance * tolerance.value : 0,
            .free_count = static_cast<double>(monitor_.free_count()),
            .least_move = tolerance.relative ? 0 : run_.tolerance * tolerance.value};
  }

  /// Runs a part of a phase; true when the job goes on.
  bool run_part(PhaseMonitor& phase_monitor, const OptimizePhase& phase, int most_sweeps) {
    if (monitor_.sweeps_left() == 0) return !monitor_.end(StopReason::iteration_limit);
    phase_monitor.limit(most_sweeps);
    backend_.optimize_phase(sweeper_, phase, phase_monitor);
    last_ = phase_monitor.last();
    monitor_.record_remaining(phase_monitor.remaining_gain());
    return !phase_monitor.job_ended();
  }

  /// Runs a whole phase; true when the job goes on.
  bool run_phase(const OptimizePhase& phase, const PhaseEnd& end,
                 int most_sweeps = PhaseMonitor::kNoLimit) {
    PhaseMonitor phase_monitor(monitor_, phase, end, method_.target_quality);
    sweeper_.wake_all();
    return run_part(phase_monitor, phase, most_sweeps);
  }

  /// Repairs tangled balls until none is left or they do not improve.
  bool repair(int most_sweeps = PhaseMonitor::kNoLimit) {
    return run_phase({.power = 1, .guard = false}, {.when_untangled = true}, most_sweeps);
  }

  /// Sweeps of an energy that is regularized in every ball, by less and less: continuation. At
  /// first it is nearly that of springs, in which elements pass through each other; at last the
  /// true one of power 1. Facets at sliding nodes hold each other in it, unless they may turn over
  /// as the elements do.
  bool soften(bool facets) {
    constexpr int kStages = 10;
    constexpr int kSweepsOfStage = 10;
    double softness = 1;
    for (int stage = 0; stage < kStages; ++stage, softness /= 2) {
      if (!run_phase({.power = 1, .guard = false, .facets = facets, .softness = softness},
                     {.least_gain = 1e-3}, kSweepsOfStage))
        return false;
    }
    return true;
  }

  /// Softens and repairs from `saved`; true when the job goes on. Facets that were right then are.
  bool soften_and_repair(const Saved& saved) {
    const bool goes_on = soften(false) && repair(run_.repairs);
    if (!turns_facets(executor_, context_.around.sliding, saved.positions.data(),
                      sweeper_.positions())) {
      return goes_on;
    }
    restore(saved);
    return goes_on && soften(true) && repair(run_.repairs);
  }

  /// True when the job goes on. Where inverted elements are left, moves that inverted a valid one
  /// are undone. What keeps elements flat is where their nodes may move, which softening does not
  /// change.
  bool untangle() {
    bool goes_on = repair(kUntanglingSweeps);
    if (goes_on && last_.tangled > 0 && run_.softens) {
      const MeshEnergy repaired = sweeper_.measure(1);
      if (repaired.worst > -kFlatMeanRatio) {
        goes_on = repair(run_.repairs);
      } else {
        const Saved saved = save();
        goes_on = soften_and_repair(saved);
        if (last_.tangled > 0 && sweeper_.measure(1).invalid > repaired.invalid) restore(saved);
      }
    }
    if (last_.tangled > 0 && undoes()) undo_inversions();
    return goes_on;
  }

  [[nodiscard]] bool undoes() const { return plan_.options.guard && run_.given != nullptr; }

  /// Undoes moves that inverted an element which was valid in the input.
  void undo_inversions() {
    const auto before = positions_in_order(executor_, run_.given->positions, run_.given->caller_ids,
                                           context_.around.node_count);
    auto repaired = context_;
    repaired.acceptance = {.guard = true, .facets = context_.around.sliding.any()};
    repaired.displacement_limit = {};
    limit_moves(executor_, repaired, before.data(), sweeper_.positions());
  }

  /// A phase that descends a power of the energy.
  [[nodiscard]] OptimizePhase descent(int power) const {
    OptimizePhase phase{.power = power, .guard = plan_.options.guard};
    if (run_.ring_entries > 0 && plan_.options.tolerance.relative) {
      // Nodes at rest end a job, and do not tell whether a long error is left.
      phase.rest *= std::min(1.0, plan_.options.tolerance.value / Tolerance{}.value);
    }
    return phase;
  }

  /// Descends the goal's energy; true when the job goes on.
  bool descend(const PhaseEnd& converged) {
    const bool global = run_.ring_entries > 0;
    const OptimizePhase phase = descent(power_of(method_.goal));
    PhaseMonitor phase_monitor(monitor_, phase, converged, method_.target_quality);
    sweeper_.wake_all();
    if (!run_part(phase_monitor, phase, global ? kSweepsBeforeSteps : kDescentSweeps)) return false;
    if (last_.tangled > 0) {
      return phase_monitor.ended() || run_part(phase_monitor, phase, PhaseMonitor::kNoLimit);
    }
    const auto nearly_flat = [&](const MeshEnergy& mesh) {
      return mesh.invalid == 0 && mesh.worst < kNearlyFlat;
    };
    MeshEnergy reached = sweeper_.measure(phase.power);
    far_ = global && !phase_monitor.ended();
    if (far_) {
      if (!descend_far(phase, converged)) return false;
      reached = sweeper_.measure(phase.power);
    }
    if (nearly_flat(reached)) return escape(phase, converged, reached.energy);
    if (!global && !phase_monitor.ended() && !descend_far(phase, converged)) return false;
    return attain(phase, converged);
  }

  /// Where all elements come near their shape in the reference, the energy is flat: goes on until
  /// they have it.
  bool attain(OptimizePhase phase, PhaseEnd converged) {
    constexpr double kNear = 1.02;  // p-mean of f; 1: they have it
    constexpr double kPrecision = 1e-2;
    if (!run_.precise || context_.around.targets.reference == nullptr || converged.tolerance == 0) {
      return true;
    }
    if (plan_.iteration_limit <= kDescentSweeps) return true;  // as `optimize_bytes` assumes
    if (!(mean_energy(sweeper_.measure(phase.power), phase.power) < kNear)) return true;
    phase.rest *= kPrecision * kPrecision;
    converged.tolerance *= kPrecision;
    return descend_far(phase, converged);
  }

  bool descend_far(const OptimizePhase& phase, const PhaseEnd& converged) {
    if (run_.ring_entries > 0) {
      GlobalSteps<E, Real> steps(executor_, sweeper_, run_.ring_entries, phase.power,
                                 monitor_.in_mesh_unit(Tolerance{1}));
      return descend_far(phase, converged, steps);
    }
    AndersonMixing<E, Real> mixing(executor_, sweeper_, phase.power);
    return descend_far(phase, converged, mixing);
  }

  /// Accelerated sweeps of a valid mesh.
  template <class Acceleration>
  bool descend_far(const OptimizePhase& phase, const PhaseEnd& converged,
                   Acceleration& acceleration) {
    constexpr int kSpan = 3;               // sweeps over which the fall of the gains is taken
    constexpr double kFarTolerance = 0.1;  // of a long error each sweep is a smaller share
    // Times the tolerance: where few elements have nearly all of the energy, steps for their sake
    // and sweeps for the others' undo each other for thousands of sweeps.
    constexpr double kStanding = 1e-5;
    PhaseMonitor phase_monitor(monitor_, phase, {.least_move = converged.least_move},
                               method_.target_quality);
    PhaseEnd end = converged;
    if (run_.precise || run_.ring_entries > 0) end.tolerance *= kFarTolerance;
    if (!run_.precise) end.free_count = 0;
    std::array<double, kSpan + 1> gains{};
    int standing = 0;  // sweeps
    for (int sweep = 0;; ++sweep) {
      acceleration.begin();
      if (!run_part(phase_monitor, phase, 1)) return false;
      if (phase_monitor.ended()) return true;
      const double factor = acceleration.extrapolate();
      OptimizeStats whole = last_;  // with what the extrapolation added
      whole.gain *= factor;
      whole.squared_gain *= factor * factor;
      const double earlier = gains[(sweep + 1) % gains.size()];
      gains[sweep % gains.size()] = whole.gain;
      if constexpr (requires { acceleration.relative_fall(); }) {
        standing =
            acceleration.relative_fall() < kStanding * converged.tolerance ? standing + 1 : 0;
        if (standing == kSpan) return true;
      }
      if (sweep < kSpan) continue;
      const auto moved = static_cast<double>(last_.moves.moved);
      if (factor == 1 && last_.gain < 2 * phase.rest * moved) return true;  // nearly at rest
      if (end.settled(whole, whole.gain * std::cbrt(earlier / whole.gain))) return true;
    }
  }

  /// From a valid mesh that is nearly flat somewhere: softens it, then descends. Returns to where
  /// it was unless the outcome is valid and better. True when the job goes on.
  bool escape(const OptimizePhase& phase, const PhaseEnd& converged, double energy) {
    const Saved saved = save();
    bool goes_on = soften_and_repair(saved);
    if (goes_on && last_.tangled == 0) goes_on = descend_far(phase, converged);
    const MeshEnergy after = sweeper_.measure(phase.power);
    if (after.invalid > 0 || !(after.energy < energy)) restore(saved);
    return goes_on;
  }

  [[nodiscard]] Saved save() {
    const std::size_t node_count = context_.around.node_count;
    Saved saved{executor_.template allocate<Vec3<Real>>(node_count), last_};
    copy_positions(executor_, node_count, sweeper_.positions(), saved.positions.data());
    return saved;
  }
  void restore(const Saved& saved) {
    copy_positions(executor_, context_.around.node_count, saved.positions.data(),
                   sweeper_.positions());
    last_ = saved.last;
  }

  B& backend_;
  E& executor_;
  const SweepContext<E, Real>& context_;
  const Optimize& method_;
  ConvergenceMonitor& monitor_;
  const JobPlan& plan_;
  typename E::template Buffer<NodeId> opposite_;
  OptimizeSweeper<E, Real> sweeper_;
  OptimizeStats last_;
  OptimizeRun<Real> run_;
  bool job_ended_ = false;
  bool far_ = false;  // seven sweeps were not enough in the last run
};

/// The method Optimize.
///
/// takes  positions in internal order; surroundings with balls; a colouring
/// gives  the optimized positions in place. Valid elements stay valid; where not all
///        inverted ones could be repaired, moves that inverted a valid one are undone.
/// cost   per sweep two to four passes over each ball; `optimize_bytes`
/// order  deterministic
template <OptimizingBackend B, class Real>
void optimize(B& backend, const SweepContext<typename B::Executor, Real>& context,
              const Optimize& method, ConvergenceMonitor& monitor,
              const CallerPositions<Real>& given, Vec3<Real>* positions) {
  Optimizer<B, Real> optimizer(backend, context, method, monitor, positions);
  optimizer.run({.given = &given});
  optimizer.report();
}

}  // namespace meshsmooth::detail
