#pragma once

#include "smooth/cuda/quality/evaluator.cuh"
#include "smooth/cuda/sweeps/optimize.hpp"
#include "smooth/cuda/sweeps/sweeps.cuh"
#include "smooth/cuda/topology/colouring.cuh"
#include "smooth/cuda/topology/prepare.cuh"
#include "smooth/cuda/topology/result.cuh"
#include "smooth/steps/backend.hpp"

namespace meshsmooth::detail {

/// The steps of the CUDA backend; see `Backend`. Every call returns when its work is queued,
/// those that return a value when it is known.
class CudaBackend {
 public:
  using Executor = CudaExecutor;
  using Orientation = CudaEvaluator::Orientation;
  template <class Real>
  using Job = JobMesh<CudaExecutor, Real>;

  /// The caller's mesh must outlive the object.
  CudaBackend(CudaExecutor& executor, const TopologyView& topology, PositionsView positions)
      : executor_(executor), evaluator_(executor, topology, positions), result_(executor) {}

  [[nodiscard]] CudaExecutor& executor() { return executor_; }

  template <class Real>
  [[nodiscard]] Job<Real> prepare(const TopologyView& topology,
                                  std::span<const Vec3<Real>> positions,
                                  const SmoothOptions& options, const JobControl& control,
                                  StageTimes& times) {
    return prepare_job(executor_, topology, positions, options, control, times);
  }

  [[nodiscard]] Colouring<CudaExecutor> colour(const Surroundings& around,
                                               const NodeId* caller_ids) {
    return colour_nodes(executor_, around, caller_ids);
  }

  template <class Real, class Mean>
  void sweep(Sweeper<CudaExecutor, Real>& sweeper, const Mean& mean, double factor,
             ConvergenceMonitor& monitor) {
    run_sweeps(executor_, sweeper, mean, factor, monitor);
  }

  [[nodiscard]] DeviceBuffer<NodeId> find_opposite_nodes(const Surroundings& around) {
    if (!is_only(executor_, around.elements, ElementType::tetrahedron)) return {};
    return detail::find_opposite_nodes(executor_, around);
  }

  template <class Real>
  void optimize_phase(OptimizeSweeper<CudaExecutor, Real>& sweeper, const OptimizePhase& phase,
                      PhaseMonitor& monitor) {
    run_phase(executor_, sweeper, phase, monitor, [&] { return sweeper.measure(phase.power); });
  }

  template <class Real>
  [[nodiscard]] Orientation orient(const Job<Real>& job) {
    return evaluator_.orientation(job);
  }

  template <class Real>
  [[nodiscard]] QualityStats evaluate(const Job<Real>& job, const Orientation& orientation) {
    return evaluator_.evaluate(job, orientation, [] {}).quality;
  }

  template <class Real>
  [[nodiscard]] QualityReport evaluate_result(Job<Real>& job, const Orientation& orientation) {
    return evaluator_.evaluate(job, orientation, [&] { result_.restore_order(job); });
  }

  template <class Real>
  [[nodiscard]] const std::int64_t* write_back(Job<Real>& job, std::span<Vec3<Real>> positions) {
    return result_.write_back(job, positions);
  }

 private:
  CudaExecutor& executor_;
  CudaEvaluator evaluator_;
  ResultWriter result_;
};

static_assert(Backend<CudaBackend>);

}  // namespace meshsmooth::detail
