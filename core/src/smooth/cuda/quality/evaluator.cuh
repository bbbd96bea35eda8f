#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "smooth/base/mesh_counts.hpp"
#include "smooth/cuda/quality/find_worst.cuh"
#include "smooth/cuda/quality/kernels.cuh"
#include "smooth/cuda/topology/element_runs.cuh"

namespace meshsmooth::detail {

/// Takes values by the caller's elements into internal order.
inline DeviceBuffer<PackedDirection> in_order(CudaExecutor& executor,
                                              const DeviceBuffer<PackedDirection>& given,
                                              const JobElements<CudaExecutor>& elements) {
  auto ordered = executor.allocate<PackedDirection>(elements.view.count);
  const PackedDirection* const from = given.data();
  PackedDirection* const to = ordered.data();
  const ElementId* const caller_ids = elements.caller_ids.data();
  executor.for_each(elements.view.count,
                    [=] __device__(std::size_t e) { to[e] = from[caller_ids[e]]; });
  return ordered;
}

/// Evaluates the quality of a job on its device, in internal order, and reports the caller's ids.
class CudaEvaluator {
 public:
  /// What surface elements must not turn against.
  class Orientation {
   public:
    Orientation() = default;
    Orientation(CudaExecutor& executor, const SurfaceOrientation& found,
                const JobElements<CudaExecutor>& elements)
        : common_(found.common()) {
      if (found.normals().empty()) return;
      normals_ = executor.in_executor_memory(found.normals());
      if (elements.caller_ids.size() == 0) return;
      normals_ = in_order(executor, normals_, elements);
    }
    [[nodiscard]] const PackedDirection* references() const { return normals_.data(); }
    [[nodiscard]] Vec3d common() const { return common_; }

   private:
    DeviceBuffer<PackedDirection> normals_;
    Vec3d common_{0, 0, 0};
  };

  /// Bytes of the host: what is counted, the normals of a surface, which are found there, and the
  /// metrics of elements.
  static std::int64_t host_bytes(const MeshCounts& mesh, const SmoothOptions& options) {
    constexpr std::int64_t kAccumulators = std::int64_t{1} << 20;
    const std::int64_t normals =
        mesh.dimension == 3 ? 0 : mesh.elements * std::int64_t{sizeof(PackedDirection)};
    return kAccumulators + normals + element_quality_bytes(mesh, options);
  }

  /// Bytes of the device besides the counts.
  static std::int64_t device_bytes(const MeshCounts& mesh, const SmoothOptions& options) {
    const std::int64_t bins = mesh.elements * std::int64_t{sizeof(std::uint16_t)};
    return std::max(bins, element_quality_bytes(mesh, options));
  }

  CudaEvaluator(CudaExecutor& executor, const TopologyView& topology, PositionsView positions,
                QualityDetail quality_detail)
      : executor_(executor),
        topology_(topology),
        positions_(positions),
        quality_detail_(quality_detail) {}

  template <class Real>
  using Mesh = JobMesh<CudaExecutor, Real>;

  /// Of surfaces, on the host: they are small.
  template <class Real>
  [[nodiscard]] Orientation orientation(const Mesh<Real>& job) const {
    if (job.volume()) return {};
    const SurfaceOrientation found(topology_, positions_);
    Orientation result(executor_, found, job.elements);
    executor_.synchronize();  // `found` goes
    return result;
  }

  /// `meanwhile()` queues work that need not wait for the answer, while the host does.
  template <class Real, class Meanwhile>
  [[nodiscard]] QualityReport evaluate(const Mesh<Real>& job, const Orientation& orientation,
                                       const Meanwhile& meanwhile) {
    const bool brief = quality_detail_ == QualityDetail::brief;
    Evaluation found = brief ? launch_kernels<QualityDetail::brief>(job, orientation)
                             : launch_kernels<QualityDetail::full>(job, orientation);
    unsigned char* const copy = executor_.lane().staging(found.buffer.size());
    const std::size_t skipped = brief ? sizeof(DeviceAccumulator::bins) : 0;  // they come first
    executor_.download_later(found.buffer.data() + skipped, copy + skipped,
                             found.buffer.size() - skipped);
    const std::size_t answered = executor_.mark(executor_.lane().stream);
    meanwhile();
    executor_.wait_for(answered);
    executor_.check();
    const auto& counted = *reinterpret_cast<const DeviceAccumulator*>(copy);
    const std::span blocks(reinterpret_cast<const BlockAccumulator*>(&counted + 1),
                           found.block_count);
    return to_report(counted, blocks,
                     find_worst(executor_, counted, found.tasks, job.positions.data()),
                     job.elements.view);
  }

  /// Some metrics of every element, by the caller's ids.
  template <class Real>
  [[nodiscard]] ElementQualityArrays evaluate_elements(const Mesh<Real>& job,
                                                       const Orientation& orientation,
                                                       const std::vector<QualityMetric>& metrics) {
    const std::size_t element_count = job.elements.view.count;
    auto values = executor_.allocate<float>(metrics.size() * element_count);
    const MetricColumns columns(metrics, values.data(), element_count);
    for_each_run(executor_, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      executor_.for_each(count, StoreMetrics<Real>{make_task(job, orientation, run, count),
                                                   job.positions.data(), columns});
    });
    ElementQualityArrays result{metrics, std::vector<float>(values.size())};
    executor_.download(values.data(), values.size(), result.values.data());
    executor_.check();
    return result;
  }

 private:
  static constexpr int kTetrahedron = static_cast<int>(ElementType::tetrahedron);

  /// Queued kernels and their results.
  struct Evaluation {
    DeviceBuffer<unsigned char> buffer;  // a DeviceAccumulator and a BlockAccumulator per block
    std::size_t block_count = 0;
    DeviceBuffer<std::uint16_t> mean_ratio_bins;  // by element
    std::vector<EvaluateTask> tasks;
  };

  /// Without accumulators.
  template <class Real>
  [[nodiscard]] static EvaluateTask make_task(const Mesh<Real>& job, const Orientation& orientation,
                                              const Elements::Run& run, std::size_t count) {
    return {.shape = run.shape,
            .nodes = run.nodes,
            .first = run.first,
            .count = count,
            .caller_ids = job.elements.caller_ids.data(),
            .references = orientation.references(),
            .reference = orientation.common(),
            .fixed = job.fixed.data()};
  }

  template <QualityDetail kDetail, class Real>
  [[nodiscard]] Evaluation launch_kernels(const Mesh<Real>& job, const Orientation& orientation) {
    Evaluation evaluation;
    std::vector<unsigned int> grids;
    const auto most = 4 * static_cast<std::size_t>(executor_.lane().multiprocessor_count());
    for_each_run(executor_, job.elements, [&]<int>(const Elements::Run&, std::size_t count) {
      grids.push_back(block_count(count, most));
      evaluation.block_count += grids.back();
    });
    // One buffer, cleared and copied by one call each.
    static_assert(sizeof(DeviceAccumulator) % alignof(BlockAccumulator) == 0);
    const std::size_t bytes =
        sizeof(DeviceAccumulator) + evaluation.block_count * sizeof(BlockAccumulator);
    evaluation.buffer = executor_.allocate<unsigned char>(bytes);
    executor_.clear(evaluation.buffer.data(), bytes);
    evaluation.mean_ratio_bins = executor_.allocate<std::uint16_t>(job.elements.view.count);
    auto* const accumulator = reinterpret_cast<DeviceAccumulator*>(evaluation.buffer.data());
    auto* blocks = reinterpret_cast<BlockAccumulator*>(accumulator + 1);
    for_each_run(executor_, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      const unsigned int grid = grids[evaluation.tasks.size()];
      EvaluateTask& task = evaluation.tasks.emplace_back(make_task(job, orientation, run, count));
      task.accumulator = accumulator;
      task.blocks = blocks;
      task.mean_ratio_bins = evaluation.mean_ratio_bins.data() + run.first;
      const auto launch_kernel = [&]<bool kTetrahedra>() {
        constexpr auto kKernel = &evaluate_kernel<Real, kDetail, kTetrahedra>;
        constexpr std::size_t kBytes = kHistogramBytes<kDetail>;
        allow_shared_memory<kKernel>(executor_.lane(), kBytes);
        launch<kKernel>(executor_.stream(), {grid, kBlockSize, kBytes}, task, job.positions.data());
      };
      const bool tetrahedra = run.shape == executor_.lane().shapes() + kTetrahedron;
      tetrahedra ? launch_kernel.template operator()<true>()
                 : launch_kernel.template operator()<false>();
      blocks += grid;
    });
    for (const EvaluateTask& task : evaluation.tasks) {
      const Grid grid{block_count(task.count, 2 * most)};
      const Vec3<Real>* const positions = job.positions.data();
      if (task.shape == executor_.lane().shapes() + kTetrahedron) {
        launch<&list_worst_kernel<Real, true>>(executor_.stream(), grid, task, positions);
      } else {
        launch<&list_worst_kernel<Real, false>>(executor_.stream(), grid, task, positions);
      }
    }
    return evaluation;
  }

  [[nodiscard]] QualityReport to_report(const DeviceAccumulator& counted,
                                        std::span<const BlockAccumulator> blocks,
                                        const std::vector<RankedElement>& worst,
                                        const Elements& elements) const {
    LockedStats locked{.element_count = static_cast<std::int64_t>(counted.locked),
                       .inverted_count = static_cast<std::int64_t>(counted.locked_inverted),
                       .worst = std::nullopt};
    ChunkSums sums;
    const auto quality_of = [&](const RankedElement& e) {
      return ElementQuality{static_cast<std::int64_t>(e.element), type_of(e.element), e.mean_ratio,
                            e.scaled_jacobian};
    };
    for (const BlockAccumulator& block : blocks) {
      for (std::size_t m = 0; m < kMetricCount; ++m) sums.values[m] += block.sums.values[m];
      sums.volume += block.sums.volume;
      sums.enclosed_volume += block.sums.enclosed_volume;
      const RankedElement& e = block.worst_locked;
      if (e.element == RankedElement::kNoElement) continue;
      if (!locked.worst || worse(quality_of(e), *locked.worst)) locked.worst = quality_of(e);
    }
    const auto summary = [&](auto& total) {
      total.inverted = static_cast<std::int64_t>(counted.inverted);
      total.degenerate = static_cast<std::int64_t>(counted.degenerate);
      for (const RankedElement& e : worst) total.keep_if_worst(quality_of(e));
      return summarize(total, sums, static_cast<std::int64_t>(elements.count));
    };
    if (quality_detail_ == QualityDetail::brief) {
      BriefAccumulator total;
      return {summary(total), locked};
    }
    const auto total = std::make_unique<QualityAccumulator>();
    for (std::size_t m = 0; m < kMetricCount; ++m) {
      std::copy(std::begin(counted.bins[m]), std::end(counted.bins[m]), total->bins[m].begin());
      total->min[m] = from_ordered_bits(~counted.min[m]);
      total->max[m] = from_ordered_bits(counted.max[m]);
    }
    return {summary(*total), locked};
  }

  /// Of one of the caller's elements.
  [[nodiscard]] ElementType type_of(std::size_t element) const {
    for (const ElementBlockView& block : topology_.blocks) {
      if (element < block.element_count()) return block.type;
      element -= block.element_count();
    }
    return topology_.blocks.back().type;
  }

  CudaExecutor& executor_;
  const TopologyView& topology_;
  PositionsView positions_;
  QualityDetail quality_detail_;
};

}  // namespace meshsmooth::detail
