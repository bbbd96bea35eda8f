#pragma once

#include <array>
#include <optional>
#include <variant>

#include "smooth/averaging/windowed_sinc_sweeps.hpp"
#include "smooth/base/job_arrays.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/fit/fit.hpp"
#include "smooth/move/derivative.hpp"
#include "smooth/move/move.hpp"
#include "smooth/optimize/optimize.hpp"
#include "smooth/pipeline/backend.hpp"

namespace meshsmooth::detail {

/// Bytes that `iterate` holds besides rings and balls; `optimizing` are those of a backend's sweeps
/// of `Optimize`.
[[nodiscard]] inline std::int64_t iterate_bytes(const MeshCounts& mesh, const JobPlan& plan,
                                                std::int64_t optimizing = 0) {
  const std::int64_t positions = mesh.nodes * mesh.position_bytes;
  const Acceptance& acceptance = plan.acceptance;
  const bool limits = plan.options.movement_limit.has_value();
  std::int64_t bytes = limits ? positions : 0;
  if (plan.filters) {
    return bytes + windowed_sinc_bytes(mesh, acceptance.active() || limits, acceptance.active());
  }
  if (!plan.colours) {
    if (plan.form == Form::jacobi || acceptance.active()) bytes += positions;  // the sweeper's
    if (acceptance.active()) bytes += limit_moves_bytes(mesh.nodes, acceptance.smart);
  }
  bytes += plan.further_positions * positions;
  return bytes + (plan.optimizer ? optimize_bytes(mesh, plan, optimizing) : 0);
}

/// The same of `Move`, whose sweeps take `sweeping`; `kept`: its system is to be kept.
[[nodiscard]] inline std::int64_t moving_bytes(const MeshCounts& mesh, const JobPlan& plan,
                                               bool kept, std::int64_t sweeping) {
  return plan.derivative == Derivative::none ? motion_bytes(mesh, plan, kept, sweeping)
                                             : derivative_bytes(mesh, kept);
}

/// What some jobs do besides sweeps.
struct Tasks {
  const std::optional<MotionTask>& motion;  // of `Move`
  const std::optional<FitTask>& fit;        // with a target surface

  [[nodiscard]] bool any() const { return motion || fit; }
};

/// The sweeps of a job, by its method.
template <Backend B, class Real>
class Iteration {
 public:
  using E = typename B::Executor;

  /// What it refers to must outlive it; the tasks; of `Move` colours to fill.
  Iteration(B& backend, const SweepContext<E, Real>& context, Colouring<E>& colouring,
            ConvergenceMonitor& monitor, JobMesh<E, Real>& job, const Tasks& tasks)
      : backend_(backend),
        executor_(backend.executor()),
        context_(context),
        colouring_(colouring),
        monitor_(monitor),
        plan_(monitor.plan()),
        job_(job),
        tasks_(tasks) {}

  void operator()(const Optimize& method) {
    const CallerPositions<Real> given{job_.given.data(), job_.caller_ids.data()};
    if (!tasks_.fit) return optimize(backend_, context_, method, monitor_, given, positions());
    fit_to_surface(backend_, context_, method, monitor_, given, *tasks_.fit, positions());
  }
  void operator()(const Move& method) {
    Motion<B, Real>(backend_, context_, colouring_, method, monitor_, job_)
        .run(tasks_.motion.value());
  }
  void operator()(const WindowedSinc& method) {
    const Vec3d centre = 0.5 * (job_.box.lower + job_.box.upper);
    windowed_sinc(executor_, context_, method, centre, monitor_, positions());
  }
  void operator()(const Taubin& method) {
    Sweeper<E, Real> sweeper(executor_, context_, plan_.form, positions());
    const std::array factors{method.lambda, method.mu};
    if (plan_.form == Form::jacobi) {
      const auto step = [](double factor) {
        return LaplacianStep<UniformMean, Real>{{}, static_cast<Real>(factor)};
      };
      run_jacobi(sweeper, std::array{step(factors[0]), step(factors[1])});
    } else {
      const auto take = [&](std::size_t n) { return sweeper.step(UniformMean{}, factors[n]); };
      run_steps_one_by_one(executor_, sweeper, factors.size(), take, monitor_);
    }
    finish(sweeper);
  }
  void operator()(const HcLaplacian& method) {
    Sweeper<E, Real> sweeper(executor_, context_, plan_.form, positions());
    auto original = executor_.template allocate<Vec3<Real>>(job_.node_count);
    auto differences = executor_.template allocate<Vec3<Real>>(job_.node_count);
    sweeper.copy(sweeper.current(), original.data());
    const HcStep<Real> step{static_cast<Real>(method.alpha), static_cast<Real>(method.beta),
                            original.data(), differences.data()};
    run_jacobi(sweeper, std::array{step});
    finish(sweeper);
  }
  template <AveragingMethod M>
  void operator()(const M& method) {
    Sweeper<E, Real> sweeper(executor_, context_, plan_.form, positions());
    with_mean_of(method, [&](const auto& mean) {
      if (monitor_.keeps_history()) {
        run_sweeps_one_by_one(sweeper, mean, method.relaxation, monitor_);
      } else {
        backend_.sweep(sweeper, mean, method.relaxation, monitor_);
      }
    });
    finish(sweeper);
  }

 private:
  [[nodiscard]] Vec3<Real>* positions() { return job_.positions.data(); }

  // A history needs the mesh measured after each sweep, which batches do not allow.
  template <class Steps>
  void run_jacobi(Sweeper<E, Real>& sweeper, const Steps& steps) {
    if (monitor_.keeps_history()) {
      run_steps_one_by_one(executor_, sweeper, steps, monitor_);
    } else {
      backend_.sweep_steps(sweeper, steps, monitor_);
    }
  }
  void finish(Sweeper<E, Real>& sweeper) {
    if (sweeper.current() != positions()) sweeper.copy(sweeper.current(), positions());
  }

  B& backend_;
  E& executor_;
  const SweepContext<E, Real>& context_;
  Colouring<E>& colouring_;
  ConvergenceMonitor& monitor_;
  const JobPlan& plan_;
  JobMesh<E, Real>& job_;
  const Tasks& tasks_;
};

/// Step 3 of a job that differentiates: the mesh stays, and the result is no mesh.
///
/// gives  tangents or cotangents in the caller's array
template <Backend B, class Real>
void differentiate(B& backend, const Surroundings& around, const JobPlan& plan,
                   const JobMesh<typename B::Executor, Real>& job, const JobArrays<Real>& arrays,
                   MotionStats& stats) {
  LinearDerivative<B, Real> derivative(backend, around, job, arrays.input);
  if (plan.derivative == Derivative::tangent) {
    derivative.tangent(stats, arrays.result);
  } else {
    // With a fixed boundary no part is without fixed nodes.
    const bool may_float = plan.options.boundary != BoundaryPolicy::fixed;
    derivative.cotangent(may_float, stats, arrays.result);
  }
}

/// Step 3: sweeps until the monitor reports the end.
///
/// takes  the mesh of a job; what else it does; of `Move` colours to fill
/// gives  the smoothed positions in the job's
/// cost   O(sweeps * entries); one or two more arrays of positions, one more for a
///        movement limit: `iterate_bytes`
template <Backend B, class Real>
void iterate(B& backend, const Surroundings& around, Colouring<typename B::Executor>& colouring,
             ConvergenceMonitor& monitor, JobMesh<typename B::Executor, Real>& job,
             const Tasks& tasks) {
  using E = typename B::Executor;
  const JobPlan& plan = monitor.plan();
  if (monitor.done_at_once() && !plan.options.report_below && !tasks.any()) return;
  E& executor = backend.executor();
  SweepContext<E, Real> context{around, &colouring, plan.acceptance};
  typename E::template Buffer<Vec3<Real>> home;
  if (const std::optional<MovementLimit>& limit = plan.options.movement_limit) {
    home = executor.template allocate<Vec3<Real>>(around.node_count);
    copy_positions<E, Real>(executor, around.node_count, job.positions.data(), home.data());
    context.displacement_limit = {home.data(), monitor.in_mesh_unit(*limit)};
  }
  std::visit(Iteration<B, Real>(backend, context, colouring, monitor, job, tasks),
             plan.options.method);
}

}  // namespace meshsmooth::detail
