#pragma once

#include "smooth/cuda/quality/evaluator.cuh"
#include "smooth/cuda/sweeps/optimize.hpp"
#include "smooth/cuda/sweeps/sweeps.cuh"
#include "smooth/cuda/topology/colouring.cuh"
#include "smooth/cuda/topology/prepared.cuh"
#include "smooth/guard/kept_quality.hpp"
#include "smooth/pipeline/backend.hpp"

namespace meshsmooth::detail {

/// Queues the copy of the positions into the caller's order, on the device: to `to`, which may be
/// the given ones. Returns how many differ from these, known at the next `synchronize`.
template <class Real>
std::int64_t* restore_order(CudaExecutor& executor, const JobMesh<CudaExecutor, Real>& job,
                            Vec3<Real>* to) {
  auto* const moved = executor.lane().mapped<std::int64_t>(CudaLane::kMovedOffset);
  const Vec3<Real>* const given = job.given.data();
  const Vec3<Real>* const positions = job.positions.data();
  const NodeId* const caller_ids = job.caller_ids.data();
  executor.reduce_later(
      job.node_count, std::int64_t{0},
      [=] __device__(std::size_t node) -> std::int64_t {
        const NodeId id = caller_ids[node];
        const Vec3<Real> first = given[id];
        const bool stays = positions[node] == first;
        if (!stays || to != given) to[id] = stays ? first : positions[node];
        return stays ? 0 : 1;
      },
      Plus{}, moved);
  return moved;
}

/// The steps of the CUDA backend; see `Backend`. Every call returns when its work is queued,
/// those that return a value when it is known.
class CudaBackend {
 public:
  using Executor = CudaExecutor;
  using Orientation = CudaEvaluator::Orientation;
  template <class Real>
  using Job = JobMesh<CudaExecutor, Real>;

  /// `prepared`: what is known of the topology, or null; `at_reference`: the mesh lies as in its
  /// reference; `early`: where the result may be written before all else is done, or null. The
  /// caller's mesh must outlive the object.
  CudaBackend(CudaExecutor& executor, const TopologyView& topology, PositionsView positions,
              QualityDetail quality_detail, const CudaPreparedTopology* prepared = nullptr,
              bool at_reference = false, const PositionsSpan* early = nullptr)
      : executor_(executor),
        evaluator_(executor, topology, positions, quality_detail),
        early_(early),
        prepared_(prepared),
        at_reference_(at_reference) {}

  [[nodiscard]] CudaExecutor& executor() { return executor_; }

  [[nodiscard]] KeptReference<CudaExecutor>* kept_reference() const {
    return at_reference_ ? prepared_->kept.get() : nullptr;
  }
  template <class T>
  void keep(DeviceBuffer<T>& buffer) const {
    buffer = detail::keep(executor_, *prepared_->memory, prepared_->kept->count(), buffer,
                          buffer.size());
  }

  template <class Real>
  [[nodiscard]] Job<Real> prepare(const TopologyView& topology,
                                  std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                  const JobControl& control, StageTimes& times) {
    keeps_given_ = plan.keeps_quality;
    return prepared_ != nullptr
               ? prepare_job(executor_, *prepared_, topology, positions, plan, control, times)
               : prepare_job(executor_, topology, positions, plan, control, times);
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

  template <class Real, class Steps>
  void sweep_steps(Sweeper<CudaExecutor, Real>& sweeper, const Steps& steps,
                   ConvergenceMonitor& monitor) {
    run_steps(executor_, sweeper, steps, monitor);
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
    return evaluator_.evaluate(job, orientation, [&] { begin_write_back(job); });
  }

  template <class Real>
  [[nodiscard]] ElementQualityArrays evaluate_elements(const Job<Real>& job,
                                                       const Orientation& orientation,
                                                       const std::vector<QualityMetric>& metrics) {
    return evaluator_.evaluate_elements(job, orientation, metrics);
  }

  template <class Real>
  [[nodiscard]] const std::int64_t* write_back(Job<Real>& job, std::span<Vec3<Real>> positions) {
    if (moved_ == nullptr) moved_ = restore_order(executor_, job, result_of(job));
    if (early_ == nullptr) download(job, positions);
    return moved_;
  }

 private:
  /// Queues what of `write_back` need not wait for the evaluation. While the host reads that, it
  /// costs no time (100k download 51 to 28 us, H200).
  template <class Real>
  void begin_write_back(Job<Real>& job) {
    moved_ = restore_order(executor_, job, result_of(job));
    if (early_ != nullptr) download(job, std::get<std::span<Vec3<Real>>>(*early_));
  }

  template <class Real>
  void download(Job<Real>& job, std::span<Vec3<Real>> positions) {
    executor_.download_later(result_of(job), positions.data(), positions.size());
  }

  /// Where the caller's order is restored: over the given positions, unless nodes may go back to
  /// them.
  template <class Real>
  [[nodiscard]] Vec3<Real>* result_of(Job<Real>& job) {
    if (!keeps_given_) return job.given.data();
    if (result_.size() == 0) {
      result_ = executor_.allocate<unsigned char>(job.node_count * sizeof(Vec3<Real>));
    }
    return reinterpret_cast<Vec3<Real>*>(result_.data());
  }

  CudaExecutor& executor_;
  CudaEvaluator evaluator_;
  const PositionsSpan* early_;
  const CudaPreparedTopology* prepared_;
  bool at_reference_;
  bool keeps_given_ = false;
  DeviceBuffer<unsigned char> result_;  // positions in the caller's order
  std::int64_t* moved_ = nullptr;       // once the caller's order is restored
};

static_assert(Backend<CudaBackend>);

}  // namespace meshsmooth::detail
