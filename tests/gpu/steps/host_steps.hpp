#pragma once

// The same steps on the CPU, for what the oracle has no formula of. The CPU backend is compared
// with the oracle in tests/core.

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/on_executor.hpp"
#include "gpu/steps/optimize_phase.hpp"
#include "smooth/cpu/cpu_backend.hpp"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::test {

struct HostSession {
  JobControl control;
  detail::Interrupt interrupt{control};
  tbb::task_arena arena{1};
  detail::CpuExecutor executor{arena, interrupt};
};

/// Sweeps of a Laplacian with uniform weights, smart or not, in the form of the options.
template <class Real>
DeviceSweeps sweep_on_host(const FlatMesh& mesh, const SmoothOptions& options) {
  HostSession host;
  OnExecutor<detail::CpuExecutor, Real> here(host.executor, mesh, element_table().data());
  const detail::JobPlan plan = detail::plan_job(options);
  detail::ConvergenceMonitor monitor(plan, host.control, mesh.diagonal, mesh.free_count());
  detail::Sweeper<detail::CpuExecutor, Real> sweeper(host.executor, here.context(plan.acceptance),
                                                     plan.form, here.positions.data());
  while (!monitor.done(sweeper.step(detail::UniformMean{}, 1))) {
  }
  DeviceSweeps result;
  result.ran = true;
  result.positions =
      positions_as<double>(downloaded(host.executor, sweeper.current(), mesh.node_count()));
  result.stop_reason = monitor.reason();
  result.convergence = monitor.take();
  return result;
}

inline PhaseResult optimize_on_host(const FlatMesh& mesh, bool float32,
                                    const PhaseRequest& request) {
  HostSession host;
  detail::CpuBackend backend(host.executor, QualityDetail::full);
  const ElementShape* const shapes = element_table().data();
  return float32 ? run_optimize_phase<float>(backend, host.control, mesh, shapes, request)
                 : run_optimize_phase<double>(backend, host.control, mesh, shapes, request);
}

}  // namespace meshsmooth::test
