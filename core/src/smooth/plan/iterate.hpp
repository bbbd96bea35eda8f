#pragma once

#include <type_traits>

#include "smooth/averaging/windowed_sinc_sweeps.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/fit/fit.hpp"
#include "smooth/move/move.hpp"
#include "smooth/optimize/optimize.hpp"
#include "smooth/plan/backend.hpp"

namespace meshsmooth::detail {

/// Bytes that `iterate` holds besides rings and balls; `optimizing` are those of a backend's sweeps
/// of `Optimize`.
[[nodiscard]] inline std::int64_t iterate_bytes(const MeshCounts& mesh,
                                                const SmoothOptions& options,
                                                std::int64_t optimizing = 0) {
  const std::int64_t positions = mesh.nodes * mesh.position_bytes;
  const Acceptance acceptance = acceptance_of(options);
  std::int64_t bytes = options.movement_limit ? positions : 0;
  if (std::holds_alternative<WindowedSinc>(options.method)) {
    return bytes + windowed_sinc_bytes(mesh, acceptance.active() || options.movement_limit,
                                       acceptance.active());
  }
  if (const Form form = resolve_form(options); form != Form::gauss_seidel) {
    if (form == Form::jacobi || acceptance.active()) bytes += positions;  // the sweeper's
    if (acceptance.active()) bytes += limit_moves_bytes(mesh.nodes, acceptance.smart);
  }
  if (std::holds_alternative<Taubin>(options.method)) bytes += positions;
  if (std::holds_alternative<HcLaplacian>(options.method)) bytes += 2 * positions;
  if (std::holds_alternative<Optimize>(options.method)) {
    bytes += optimize_bytes(mesh, options, optimizing);
  }
  return bytes;
}

/// What some jobs report, and change, besides positions; null where they do not.
struct IterateExtras {
  MotionStats* motion = nullptr;               // of `Move`
  FitStats* fit = nullptr;                     // with a target surface
  NodeConstraint* node_constraints = nullptr;  // those of the surroundings, with a target surface
};

/// Step 3: sweeps until the monitor reports the end.
///
/// takes  the mesh of a job; of `Move` statistics and colours to fill
/// gives  the smoothed positions in the job's
/// cost   O(sweeps * entries); one or two more arrays of positions, one more for a
///        movement limit: `iterate_bytes`
template <Backend B, class Real>
void iterate(B& backend, const Surroundings& around, Colouring<typename B::Executor>& colouring,
             const SmoothOptions& options, ConvergenceMonitor& monitor,
             JobMesh<typename B::Executor, Real>& job, const IterateExtras& extras) {
  using E = typename B::Executor;
  Vec3<Real>* const positions = job.positions.data();
  const bool moves = extras.motion != nullptr || extras.fit != nullptr;
  if (monitor.done_at_once() && !options.report_below && !moves) return;
  E& executor = backend.executor();
  const auto allocate = [&] { return executor.template allocate<Vec3<Real>>(around.node_count); };
  SweepContext<E, Real> context{around, &colouring, acceptance_of(options)};
  typename E::template Buffer<Vec3<Real>> home;
  if (options.movement_limit) {
    home = allocate();
    copy_positions(executor, around.node_count, positions, home.data());
    context.displacement_limit = {home.data(), monitor.in_mesh_unit(*options.movement_limit)};
  }
  if (const auto* method = std::get_if<Optimize>(&options.method)) {
    const CallerPositions<Real> given{job.given.data(), job.caller_ids.data()};
    if (extras.fit == nullptr) {
      return optimize(backend, context, *method, monitor, given, positions);
    }
    Optimizer<B, Real> optimizer(backend, context, *method, monitor, positions);
    SurfaceFit<B, Real> fit(backend, context, extras.node_constraints, job.box.diagonal(),
                            positions);
    if (iteration_limit(options) == 0) {
      fit.evaluate(*extras.fit);
    } else {
      fit.run(optimizer, given, !monitor.done_at_once(), *extras.fit);
    }
    return optimizer.report();
  }
  if (std::holds_alternative<Move>(options.method)) {
    return Motion<B, Real>(backend, context, colouring, job, options, monitor, positions)
        .run(*extras.motion);
  }
  if (const auto* method = std::get_if<WindowedSinc>(&options.method)) {
    const Vec3d centre = 0.5 * (job.box.lower + job.box.upper);
    return windowed_sinc(executor, context, *method, centre, monitor, positions);
  }
  Sweeper<E, Real> sweeper(executor, context, resolve_form(options), positions);

  // A history needs the mesh measured after each sweep, which batches do not allow.
  const auto run_jacobi = [&](const auto& steps) {
    if (options.history) {
      run_steps_one_by_one(executor, sweeper, steps, monitor);
    } else {
      backend.sweep_steps(sweeper, steps, monitor);
    }
  };
  const auto run = [&](const auto& method) {
    using M = std::decay_t<decltype(method)>;
    if constexpr (std::is_same_v<M, Optimize> || std::is_same_v<M, WindowedSinc> ||
                  std::is_same_v<M, Move>) {
      return;  // above
    } else if constexpr (std::is_same_v<M, Taubin>) {
      const double factors[] = {method.lambda, method.mu};
      if (sweeper.form() == Form::jacobi) {
        const auto step = [](double factor) {
          return LaplacianStep<UniformMean, Real>{{}, static_cast<Real>(factor)};
        };
        run_jacobi(std::array{step(factors[0]), step(factors[1])});
      } else {
        const auto take = [&](std::size_t n) { return sweeper.step(UniformMean{}, factors[n]); };
        run_steps_one_by_one(executor, sweeper, 2, take, monitor);
      }
    } else if constexpr (std::is_same_v<M, HcLaplacian>) {
      auto original = allocate();
      auto differences = allocate();
      sweeper.copy(sweeper.current(), original.data());
      run_jacobi(
          std::array{HcStep<Real>{static_cast<Real>(method.alpha), static_cast<Real>(method.beta),
                                  original.data(), differences.data()}});
    } else {
      with_mean_of(method, [&](const auto& mean) {
        if (options.history) {
          run_sweeps_one_by_one(sweeper, mean, method.relaxation, monitor);
        } else {
          backend.sweep(sweeper, mean, method.relaxation, monitor);
        }
      });
    }
  };
  std::visit(run, options.method);
  if (sweeper.current() != positions) sweeper.copy(sweeper.current(), positions);
}

}  // namespace meshsmooth::detail
