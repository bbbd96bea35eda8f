#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "smooth/cpu/colouring.hpp"
#include "smooth/cpu/optimize_phase.hpp"
#include "smooth/cpu/prepare.hpp"
#include "smooth/pipeline/backend.hpp"

namespace meshsmooth::detail {

/// Host views of a job's elements in internal order.
inline std::vector<ElementBlockView> block_views(const JobElements<CpuExecutor>& elements) {
  std::vector<ElementBlockView> blocks;
  for (int r = 0; r < elements.view.run_count; ++r) {
    const Elements::Run& run = elements.view.runs[r];
    const std::size_t end =
        r + 1 < elements.view.run_count ? elements.view.runs[r + 1].first : elements.view.count;
    const auto type = static_cast<ElementType>(run.shape - element_table().data());
    blocks.push_back(
        {type, {run.nodes, (end - run.first) * static_cast<std::size_t>(run.shape->node_count)}});
  }
  return blocks;
}

/// Reference normals of surface elements; counted with the job's memory.
class CpuOrientation {
 public:
  CpuOrientation() = default;
  CpuOrientation(SurfaceOrientation orientation, ByteCount& bytes)
      : orientation_(std::move(orientation)) {
    bytes.add(orientation_.normals().size_bytes());  // lives as long as the job
  }
  [[nodiscard]] const PackedDirection* references() const {
    return orientation_.normals().empty() ? nullptr : orientation_.normals().data();
  }
  [[nodiscard]] Vec3d common() const { return orientation_.common(); }
  [[nodiscard]] const SurfaceOrientation& get() const { return orientation_; }

 private:
  SurfaceOrientation orientation_;
};

/// The steps of the CPU backend; see `Backend`. Evaluates in internal order and reports the
/// caller's ids.
class CpuBackend {
 public:
  using Executor = CpuExecutor;
  using Orientation = CpuOrientation;
  template <class Real>
  using Job = JobMesh<CpuExecutor, Real>;

  /// `prepared`: what is known of the topology, or null; `kept`: see `kept_reference`.
  CpuBackend(CpuExecutor& executor, QualityDetail quality_detail,
             const CpuPreparedTopology* prepared = nullptr,
             KeptReference<CpuExecutor>* kept = nullptr)
      : executor_(executor), quality_detail_(quality_detail), prepared_(prepared), kept_(kept) {}

  [[nodiscard]] CpuExecutor& executor() { return executor_; }

  [[nodiscard]] KeptReference<CpuExecutor>* kept_reference() const { return kept_; }
  template <class T>
  void keep(CpuBuffer<T>& buffer) const {
    buffer.count_by(kept_->count());
  }

  template <class Real>
  [[nodiscard]] Job<Real> prepare(const TopologyView& topology,
                                  std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                  const JobControl& control, StageTimes& times) {
    return prepared_ != nullptr
               ? prepare_job(executor_, *prepared_, topology, positions, plan, control, times)
               : prepare_job(executor_, topology, positions, plan, control, times);
  }

  [[nodiscard]] Colouring<CpuExecutor> colour(const Surroundings& around,
                                              const NodeId* caller_ids) {
    return colour_nodes(executor_, around, caller_ids);
  }

  template <class Real, class Mean>
  void sweep(Sweeper<CpuExecutor, Real>& sweeper, const Mean& mean, double factor,
             ConvergenceMonitor& monitor) {
    run_sweeps_one_by_one(sweeper, mean, factor, monitor);
  }

  template <class Real, class Steps>
  void sweep_steps(Sweeper<CpuExecutor, Real>& sweeper, const Steps& steps,
                   ConvergenceMonitor& monitor) {
    run_steps_one_by_one(executor_, sweeper, steps, monitor);
  }

  [[nodiscard]] CpuBuffer<NodeId> find_opposite_nodes(const Surroundings& around) {
    return detail::find_opposite_nodes(executor_, around);
  }

  template <class Real>
  void optimize_phase(OptimizeSweeper<CpuExecutor, Real>& sweeper, const OptimizePhase& phase,
                      PhaseMonitor& monitor) {
    run_phase(executor_, sweeper, phase, monitor);
  }

  template <class Real>
  [[nodiscard]] Orientation orient(const Job<Real>& job) const {
    return in_arena(job, [&](const auto& topology, const auto& positions) {
      return Orientation(SurfaceOrientation(topology, positions), executor_.bytes());
    });
  }

  template <class Real>
  [[nodiscard]] QualityStats evaluate(const Job<Real>& job, const Orientation& orientation) const {
    return in_arena(job, [&](const auto& topology, const auto& positions) {
      return measure_quality(topology, positions, orientation.get(), caller_ids(job.elements),
                             quality_detail_);
    });
  }

  template <class Real>
  [[nodiscard]] QualityReport evaluate_result(const Job<Real>& job,
                                              const Orientation& orientation) const {
    return {evaluate(job, orientation),
            in_arena(job, [&](const auto& topology, const auto& positions) {
              return measure_locked(topology, {job.fixed.data(), job.node_count}, positions,
                                    orientation.get(), caller_ids(job.elements));
            })};
  }

  template <class Real>
  [[nodiscard]] ElementQualityArrays evaluate_elements(
      const Job<Real>& job, const Orientation& orientation,
      const std::vector<QualityMetric>& metrics) const {
    executor_.check();
    ElementQualityArrays result = in_arena(job, [&](const auto& topology, const auto& positions) {
      return measure_elements(topology, positions, orientation.get(), metrics,
                              caller_ids(job.elements));
    });
    executor_.bytes().add(std::span(result.values).size_bytes());  // until the end of the job
    return result;
  }

  template <class Real>
  [[nodiscard]] const std::int64_t* write_back(const Job<Real>& job,
                                               std::span<Vec3<Real>> positions) {
    const NodeId* const caller_ids = job.caller_ids.data();
    const Vec3<Real>* const given = job.given.data();  // the same array, unless a reference moves
    const Vec3<Real>* const from = job.positions.data();
    Vec3<Real>* const to = positions.data();
    executor_.check();  // the last chance to end without a result
    moved_ = run_in(executor_.arena(), [&] {
      return parallel_reduce(
          positions.size(), std::int64_t{0},
          [=](std::size_t node) -> std::int64_t {
            const auto id = static_cast<std::size_t>(caller_ids[node]);
            const bool stays = from[node] == given[id];
            to[id] = stays ? given[id] : from[node];
            return stays ? 0 : 1;
          },
          std::plus<>());
    });
    return &moved_;
  }

 private:
  template <class Real, class Functor>
  auto in_arena(const Job<Real>& job, const Functor& functor) const {
    const std::vector<ElementBlockView> blocks = block_views(job.elements);
    const TopologyView topology{job.node_count, blocks, {}};
    const PositionsView positions =
        std::span<const Vec3<Real>>(job.positions.data(), job.node_count);
    return run_in(executor_.arena(), [&] { return functor(topology, positions); });
  }

  static std::span<const ElementId> caller_ids(const JobElements<CpuExecutor>& elements) {
    return {elements.caller_ids.data(), elements.view.count};
  }

  CpuExecutor& executor_;
  QualityDetail quality_detail_;
  const CpuPreparedTopology* prepared_;
  KeptReference<CpuExecutor>* kept_;
  std::int64_t moved_ = 0;
};

static_assert(Backend<CpuBackend>);

}  // namespace meshsmooth::detail
