#pragma once

// The same steps on the CPU, for what the oracle has no formula of. The CPU backend is judged by
// the oracle in tests/core.

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/on_executor.hpp"
#include "gpu/steps/optimize_phase.hpp"
#include "smooth/cpu/cpu_executor.hpp"
#include "smooth/steps/iterate.hpp"

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
  detail::ConvergenceMonitor monitor(options, host.control, mesh.diagonal, mesh.free_count());
  detail::Sweeper<detail::CpuExecutor, Real> sweeper(
      host.executor, here.around, here.colouring, detail::resolve_form(options),
      detail::acceptance_of(options), {}, here.positions.data());
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
  const auto run = [&]<class Real>() {
    return run_optimize_phase<detail::CpuExecutor, Real>(host.executor, host.control, mesh,
                                                         element_table().data(), request);
  };
  return float32 ? run.template operator()<float>() : run.template operator()<double>();
}

}  // namespace meshsmooth::test
