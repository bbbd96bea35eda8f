#pragma once

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/on_executor.hpp"
#include "smooth/pipeline/backend.hpp"

namespace meshsmooth::test {

/// One phase of Optimize on a backend.
template <class Real, detail::Backend B>
PhaseResult run_optimize_phase(B& backend, const JobControl& control, const FlatMesh& mesh,
                               const ElementShape* shapes, const PhaseRequest& request) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  OnExecutor<E, Real> there(executor, mesh, shapes);
  SmoothOptions options;
  options.method = Optimize{};
  options.max_iterations = request.sweeps;
  options.tolerance = {0, false};
  const detail::JobPlan plan = detail::plan_job(options);
  detail::ConvergenceMonitor monitor(plan, control, mesh.diagonal, mesh.free_count());
  const auto opposite = backend.find_opposite_nodes(there.around);
  const auto home = uploaded(executor, positions_as<Real>(mesh.positions));
  auto context = there.context({});
  context.around.opposite = opposite.data();
  if (request.movement_limit) context.displacement_limit = {home.data(), *request.movement_limit};
  detail::OptimizeSweeper<E, Real> sweeper(executor, context, there.positions.data());
  const detail::OptimizePhase phase{request.power, request.poor, request.guard};
  detail::PhaseMonitor phase_monitor(monitor, phase, {}, 0);
  sweeper.wake_all();
  backend.optimize_phase(sweeper, phase, phase_monitor);

  const detail::OptimizeStats last = phase_monitor.last();
  const detail::MeshEnergy energy = sweeper.measure(request.power);
  return {.positions =
              positions_as<double>(downloaded(executor, sweeper.positions(), mesh.node_count())),
          .sweeps = monitor.take().iteration_count,
          .gain = last.gain,
          .tangled = last.tangled,
          .moved = last.moves.moved,
          .held = last.moves.held,
          .energy = energy.energy,
          .weight = energy.weight,
          .worst_mean_ratio = energy.worst,
          .invalid = energy.invalid};
}

}  // namespace meshsmooth::test
