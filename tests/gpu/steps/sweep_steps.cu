#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/device_session.cuh"
#include "smooth/cuda/sweeps/sweeps.cuh"
#include "smooth/guard/sweep_context.hpp"
#include "smooth/pipeline/iterate.hpp"

namespace meshsmooth::test {
namespace {

using detail::CudaExecutor;
using detail::UniformMean;

template <class Real>
using Sweeper = detail::Sweeper<CudaExecutor, Real>;

struct MethodParts {
  Weighting weighting = Weighting::uniform;
  double relaxation = 1;
};
MethodParts parts_of(const Method& method) {
  if (const auto* m = std::get_if<Laplacian>(&method)) return {m->weighting, m->relaxation};
  if (const auto* m = std::get_if<SmartLaplacian>(&method)) return {m->weighting, m->relaxation};
  return {};
}

/// Sweep after sweep, each by calls of the host.
template <class Real>
void sweep_by_steps(CudaExecutor& executor, const FlatMesh& mesh, Sweeper<Real>& sweeper,
                    const SmoothOptions& options, detail::ConvergenceMonitor& monitor) {
  if (const auto* hc = std::get_if<HcLaplacian>(&options.method)) {
    auto original = executor.allocate<Vec3<Real>>(mesh.node_count());
    auto differences = executor.allocate<Vec3<Real>>(mesh.node_count());
    sweeper.copy(sweeper.current(), original.data());
    const detail::HcStep<Real> step{static_cast<Real>(hc->alpha), static_cast<Real>(hc->beta),
                                    original.data(), differences.data()};
    while (!monitor.done(sweeper.step(step))) {
    }
    return;
  }
  const double factor = parts_of(options.method).relaxation;
  while (!monitor.done(sweeper.step(UniformMean{}, factor))) {
  }
}

template <int kTeam, class Real>
void sweep_coloured(CudaExecutor& executor, Sweeper<Real>& sweeper, const MethodParts& parts,
                    detail::ConvergenceMonitor& monitor) {
  const auto factor = static_cast<Real>(parts.relaxation);
  if (kTeam == 16 || parts.weighting == Weighting::uniform) {
    detail::run_coloured_sweeps<kTeam>(executor, sweeper, UniformMean{}, factor, monitor);
  } else if constexpr (kTeam != 16) {  // the product has no other either
    detail::run_coloured_sweeps<kTeam>(executor, sweeper, detail::BallVolumeMean{}, factor,
                                       monitor);
  }
}

/// False where the kernel declines the mesh.
template <class Real>
bool sweep_by(SweepKernel kernel, CudaExecutor& executor, const FlatMesh& mesh,
              Sweeper<Real>& sweeper, const SmoothOptions& options,
              detail::ConvergenceMonitor& monitor) {
  const MethodParts parts = parts_of(options.method);
  const auto factor = static_cast<Real>(parts.relaxation);
  switch (kernel) {
    case SweepKernel::resident:
      if constexpr (std::is_same_v<Real, float>) {
        const auto patch =
            detail::PatchSizes::of(mesh.node_count(), sizeof(Real), executor.lane().limits());
        return patch && detail::run_resident_sweeps(executor, *patch, sweeper, factor, monitor);
      }
      return false;
    case SweepKernel::jacobi:
      detail::with_mean(parts.weighting, [&](const auto& mean) {
        detail::run_jacobi_sweeps(executor, sweeper, mean, factor, monitor);
      });
      return true;
    case SweepKernel::jacobi_sell: {
      const auto rings = detail::SellRings::of(executor, sweeper.around());
      if (!rings) return false;
      detail::run_jacobi_sweeps(executor, sweeper, detail::SellMean(*rings), factor, monitor);
      return true;
    }
    case SweepKernel::coloured_8:
      sweep_coloured<8>(executor, sweeper, parts, monitor);
      return true;
    case SweepKernel::coloured_16:
      sweep_coloured<16>(executor, sweeper, parts, monitor);
      return true;
    case SweepKernel::coloured_32:
      sweep_coloured<32>(executor, sweeper, parts, monitor);
      return true;
    case SweepKernel::step:
      sweep_by_steps(executor, mesh, sweeper, options, monitor);
      return true;
  }
  return false;
}

template <class Real>
DeviceSweeps sweep(const FlatMesh& mesh, SweepKernel kernel, const SmoothOptions& options) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  OnDevice<Real> there(executor, mesh, device.lane.shapes());
  const detail::JobPlan plan = detail::plan_job(options);
  detail::ConvergenceMonitor monitor(plan, device.control, mesh.diagonal, mesh.free_count());
  Sweeper<Real> sweeper(executor, there.context(plan.acceptance), plan.form,
                        there.positions.data());
  DeviceSweeps result;
  result.ran = sweep_by(kernel, executor, mesh, sweeper, options, monitor);
  result.positions =
      positions_as<double>(downloaded(executor, sweeper.current(), mesh.node_count()));
  result.stop_reason = monitor.reason();
  result.convergence = monitor.take();
  return result;
}

}  // namespace

std::vector<std::vector<DeviceVisit>> ball_records_on_device(const FlatMesh& mesh) {
  DeviceSession device;
  CudaExecutor& executor = device.executor;
  const OnDevice<double> there(executor, mesh, device.lane.shapes());
  const detail::BallRecords found = detail::record_balls(executor, there.around, there.colouring);
  const auto records = downloaded(executor, found.records.data(), mesh.colour_nodes.size());
  const auto first = downloaded(executor, found.first.data(), found.first.size());
  std::vector<std::vector<DeviceVisit>> colours;
  for (int c = 0; c < found.colour_count; ++c) {
    colours.emplace_back();
    for (std::uint32_t n = first[c]; n < first[c + 1]; ++n) {
      colours.back().push_back({records[n].node, records[n].begin, records[n].size});
    }
  }
  return colours;
}

DeviceSweeps sweep_on_device(const FlatMesh& mesh, SweepKernel kernel, bool float32,
                             const SmoothOptions& options) {
  return float32 ? sweep<float>(mesh, kernel, options) : sweep<double>(mesh, kernel, options);
}

}  // namespace meshsmooth::test
