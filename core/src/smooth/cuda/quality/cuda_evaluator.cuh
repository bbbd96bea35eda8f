#pragma once

#include <cub/block/block_scan.cuh>

#include <memory>

#include "mesh/accumulator.hpp"
#include "mesh/measure.hpp"
#include "smooth/cuda/topology/cuda_topology.cuh"

namespace meshsmooth::detail {

/// An element as it is ranked: the lower, the worse.
struct RankedElement {
  double mean_ratio;
  double scaled_jacobian;
  std::uint64_t element;  // the caller's; kNoElement: none

  static constexpr std::uint64_t kNoElement = ~std::uint64_t{0};

  [[nodiscard]] MESHSMOOTH_HD bool worse_than(const RankedElement& other) const {
    if (other.element == kNoElement) return element != kNoElement;
    if (element == kNoElement) return false;
    return mean_ratio != other.mean_ratio ? mean_ratio < other.mean_ratio : element < other.element;
  }
};

/// What all blocks count together; the order of counting does not matter.
struct DeviceAccumulator {
  unsigned int bins[kMetricCount][kBinCount];
  // ordered_bits; of the least their complement, so that both grow from 0
  unsigned long long min[kMetricCount], max[kMetricCount];
  unsigned long long inverted, degenerate, locked, locked_inverted;
  unsigned int listed_count;
  static constexpr unsigned int kMostListed = 256;
  RankedElement listed[kMostListed];  // among which are the worst
};

/// What each block finds in the elements that it is given by the grid alone.
struct BlockAccumulator {
  ChunkSums sums;
  RankedElement worst_locked;
};

/// The elements of one type to judge.
struct EvaluateTask {
  const ElementShape* shape;
  const NodeId* nodes;
  std::size_t first, count;
  const ElementId* names;             // of all elements, or null
  const PackedDirection* references;  // of all elements, or null: all have `reference`
  Vec3d reference;
  const std::uint8_t* fixed;
  DeviceAccumulator* accumulate;
  BlockAccumulator* blocks;
};

/// The metrics of a type, the first `count` of them.
struct MetricsOfType {
  int count;
  int metrics[5];
};
MESHSMOOTH_HD inline MetricsOfType metrics_of(const ElementShape& shape) {
  if (shape.dimension == 3 && shape.node_count == 4) return {5, {0, 1, 2, 3, 4}};
  if (shape.dimension == 2 && shape.node_count == 3) return {4, {0, 1, 5, 6, 0}};
  return {2, {0, 1, 0, 0, 0}};
}

/// Thread 0 has the sum, by a fixed tree.
__device__ inline double sum_block(double value, double* shared) {
  return reduce_block(value, shared, [](double a, double b) { return a + b; });
}

/// An element of a task in double.
template <class Real>
__device__ ElementMeasure measure_in(const EvaluateTask& task, const ElementShape& shape,
                                     const Vec3<Real>* positions, std::size_t e) {
  Vec3d corners[kMaxElementNodes];
  for (int n = 0; n < shape.node_count; ++n) {
    corners[n] = vec3_cast<double>(
        positions[task.nodes[e * static_cast<std::size_t>(shape.node_count) + n]]);
  }
  const Vec3d reference = task.references == nullptr
                              ? task.reference
                              : unpack_direction(task.references[task.first + e]);
  return measure_element(shape, corners, reference);
}
__device__ inline RankedElement ranked(const EvaluateTask& task, std::size_t e,
                                       const ElementMeasure& m) {
  const std::size_t id = task.first + e;
  return {finite_measure(m.mean_ratio), finite_measure(m.scaled_jacobian),
          task.names == nullptr ? static_cast<ElementId>(id) : task.names[id]};
}

/// Lists the elements in the lowest bins of the mean ratio that together hold
/// kWorstCount; counts on where there is no more room.
template <class Real>
__global__ void __launch_bounds__(kBlockSize)
    list_worst_kernel(EvaluateTask task, const Vec3<Real>* positions) {
  using Scan = cub::BlockScan<unsigned int, kBlockSize>;
  __shared__ typename Scan::TempStorage scan_space;
  __shared__ unsigned int shared_bin;
  constexpr unsigned int kEach = kBinCount / kBlockSize;
  const unsigned int first = threadIdx.x * kEach;
  unsigned int own = 0, below = 0;
  for (unsigned int b = first; b < first + kEach; ++b) own += task.accumulate->bins[0][b];
  if (threadIdx.x == 0) shared_bin = kBinCount - 1;
  Scan(scan_space).ExclusiveSum(own, below);
  __syncthreads();
  if (below < kWorstCount && below + own >= kWorstCount) {
    unsigned int bin = first;
    while ((below += task.accumulate->bins[0][bin]) < kWorstCount) ++bin;
    shared_bin = bin;
  }
  __syncthreads();
  const std::size_t highest = shared_bin;
  const ElementShape& shape = *task.shape;
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t e = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; e < task.count;
       e += step) {
    const ElementMeasure m = measure_in(task, shape, positions, e);
    const double value = isfinite(m.mean_ratio) ? m.mean_ratio : 0;
    if (metric_bin(0, value) > highest) continue;
    const unsigned int place = atomicAdd(&task.accumulate->listed_count, 1U);
    if (place < DeviceAccumulator::kMostListed) task.accumulate->listed[place] = ranked(task, e, m);
  }
}

/// The worst of all elements that are better than `after`.
template <class Real>
RankedElement find_next_worst(CudaExecutor& executor, const EvaluateTask& task,
                              const Vec3<Real>* positions, RankedElement after) {
  return executor.reduce(
      task.count, RankedElement{0, 0, RankedElement::kNoElement},
      [=] __device__(std::size_t e) -> RankedElement {
        const RankedElement own = ranked(task, e, measure_in(task, *task.shape, positions, e));
        const bool later = after.element == RankedElement::kNoElement || after.worse_than(own);
        return later ? own : RankedElement{0, 0, RankedElement::kNoElement};
      },
      [] __device__(const RankedElement& a, const RankedElement& b) -> RankedElement {
        return b.worse_than(a) ? b : a;
      });
}

template <class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    evaluate_kernel(EvaluateTask task, const Vec3<Real>* positions) {
  extern __shared__ unsigned int bins[];  // [metric of the type][bin]
  __shared__ double shared[kBlockSize];
  __shared__ RankedElement shared_ranked[kBlockSize];
  const ElementShape& shape = *task.shape;
  const MetricsOfType metrics = metrics_of(shape);
  for (int i = static_cast<int>(threadIdx.x); i < metrics.count * int{kBinCount}; i += kBlockSize) {
    bins[i] = 0;
  }
  __syncthreads();

  const double infinity = HUGE_VAL;
  double sums[5] = {}, volume = 0, enclosed = 0;
  double min[5] = {infinity, infinity, infinity, infinity, infinity};
  double max[5] = {-infinity, -infinity, -infinity, -infinity, -infinity};
  unsigned int inverted = 0, degenerate = 0, locked = 0, locked_inverted = 0;
  RankedElement worst_locked{0, 0, RankedElement::kNoElement};
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t e = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; e < task.count;
       e += step) {
    const ElementMeasure m = measure_in(task, shape, positions, e);
    double values[5] = {m.mean_ratio, m.scaled_jacobian, 0, 0, 0};
    if (metrics.count == 5) {
      values[2] = m.radius_ratio;
      values[3] = degrees(m.min_angle_cos);
      values[4] = degrees(m.max_angle_cos);
    } else if (metrics.count == 4) {
      values[2] = degrees(m.min_angle_cos);
      values[3] = degrees(m.max_angle_cos);
    }
#pragma unroll
    for (int v = 0; v < 5; ++v) {
      if (v >= metrics.count) continue;
      if (!isfinite(values[v])) values[v] = 0;
      sums[v] += values[v];
      min[v] = values[v] < min[v] ? values[v] : min[v];
      max[v] = values[v] > max[v] ? values[v] : max[v];
      const auto metric = static_cast<std::size_t>(metrics.metrics[v]);
      atomicAdd(&bins[v * kBinCount + metric_bin(metric, values[v])], 1U);
    }
    volume += std::abs(m.volume);
    if (shape.dimension == 3) enclosed += m.volume;
    inverted += m.inverted ? 1 : 0;
    degenerate += m.degenerate ? 1 : 0;
    bool all_fixed = true;
    for (int n = 0; n < shape.node_count; ++n) {
      all_fixed &= task.fixed[task.nodes[e * static_cast<std::size_t>(shape.node_count) + n]] != 0;
    }
    if (!all_fixed) continue;
    ++locked;
    locked_inverted += m.inverted ? 1 : 0;
    const RankedElement own = ranked(task, e, m);
    if (own.worse_than(worst_locked)) worst_locked = own;
  }

  BlockAccumulator& own = task.blocks[blockIdx.x];
#pragma unroll
  for (int v = 0; v < 5; ++v) {
    if (v >= metrics.count) continue;
    const int metric = metrics.metrics[v];
    const double sum = sum_block(sums[v], shared);
    const double least =
        reduce_block(min[v], shared, [](double a, double b) { return a < b ? a : b; });
    const double most =
        reduce_block(max[v], shared, [](double a, double b) { return a > b ? a : b; });
    if (threadIdx.x == 0) {
      own.sums.values[static_cast<std::size_t>(metric)] = sum;
      atomicMax(&task.accumulate->min[metric], ~ordered_bits(least));
      atomicMax(&task.accumulate->max[metric], ordered_bits(most));
    }
  }
  volume = sum_block(volume, shared);
  enclosed = sum_block(enclosed, shared);
  worst_locked = reduce_block(
      worst_locked, shared_ranked,
      [](const RankedElement& a, const RankedElement& b) { return b.worse_than(a) ? b : a; });
  if (threadIdx.x == 0) {
    own.sums.volume = volume;
    own.sums.enclosed_volume = enclosed;
    own.worst_locked = worst_locked;
  }
  const auto add = [](unsigned long long& total, unsigned int part) {
    if (part != 0) atomicAdd(&total, static_cast<unsigned long long>(part));
  };
  add(task.accumulate->inverted, inverted);
  add(task.accumulate->degenerate, degenerate);
  add(task.accumulate->locked, locked);
  add(task.accumulate->locked_inverted, locked_inverted);
  for (int v = 0; v < metrics.count; ++v) {
    for (int b = static_cast<int>(threadIdx.x); b < int{kBinCount}; b += kBlockSize) {
      const unsigned int count = bins[v * int{kBinCount} + b];
      if (count != 0) atomicAdd(&task.accumulate->bins[metrics.metrics[v]][b], count);
    }
  }
}

/// What is given by the caller's elements, by the internal ones.
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

/// Judges a job on its device, in internal order, and gives the caller's ids back.
class CudaEvaluator {
 public:
  CudaEvaluator(CudaExecutor& executor, const TopologyView& topology, PositionsView positions)
      : executor_(executor), topology_(topology), positions_(positions) {}

  template <class Real>
  using Mesh = JobMesh<CudaExecutor, Real>;

  class Orientation {
   public:
    Orientation() = default;
    Orientation(CudaExecutor& executor, const SurfaceOrientation& judged,
                const JobElements<CudaExecutor>& elements)
        : common_(judged.common()) {
      if (judged.normals().empty()) return;
      normals_ = executor.in_executor_memory(judged.normals());
      if (elements.caller_ids.size() != 0) normals_ = in_order(executor, normals_, elements);
    }
    [[nodiscard]] const PackedDirection* references() const { return normals_.data(); }
    [[nodiscard]] Vec3d common() const { return common_; }

   private:
    DeviceBuffer<PackedDirection> normals_;
    Vec3d common_{0, 0, 0};
  };

  /// Of surfaces, on the host: they are small.
  template <class Real>
  [[nodiscard]] Orientation orientation(const Mesh<Real>& job) const {
    if (job.volume()) return {};
    const SurfaceOrientation judged(topology_, positions_);
    Orientation result(executor_, judged, job.elements);
    executor_.synchronize();  // `judged` goes
    return result;
  }

  template <class Real>
  [[nodiscard]] QualityStats quality(const Mesh<Real>& job, const Orientation& orientation) {
    return judge(job, orientation, [] {}).quality;
  }

  template <class Real>
  [[nodiscard]] QualityReport report(const Mesh<Real>& job, const Orientation& orientation) {
    return judge(job, orientation, [] {});
  }

  /// Queues the way back of all positions; gives how many differ from the input, once that is
  /// done.
  template <class Real>
  const std::int64_t* write_back(Mesh<Real>& job, std::span<Vec3<Real>> positions) const {
    restore_order(job);
    executor_.download_later(job.given.data(), positions.data(), positions.size());
    return moved();
  }

  /// Queues the copying of what has moved to where the caller has it.
  template <class Real>
  void restore_order(Mesh<Real>& job) const {
    Vec3<Real>* const given = job.given.data();
    const Vec3<Real>* const places = job.places.data();
    const NodeId* const caller_ids = job.caller_ids.data();
    const std::uint8_t* const fixed = job.fixed.data();
    executor_.reduce_later(
        job.node_count, std::int64_t{0},
        [=] __device__(std::size_t node) -> std::int64_t {
          Vec3<Real>& target = given[caller_ids[node]];
          if (fixed[node] != 0 || places[node] == target) return 0;
          target = places[node];
          return 1;
        },
        [] __device__(std::int64_t a, std::int64_t b) { return a + b; }, moved());
  }

 private:
  /// `meanwhile` queues what need not wait for the answer.
  template <class Real>
  [[nodiscard]] QualityReport judge(const Mesh<Real>& job, const Orientation& orientation,
                                    const auto& meanwhile) {
    CudaExecutor& executor = executor_;
    unsigned int blocks_of[kElementTypeCount];
    unsigned int block_total = 0;
    const auto most = 4 * static_cast<std::size_t>(executor.lane().multiprocessor_count());
    for_each_run(executor, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      const auto r = static_cast<std::size_t>(&run - job.elements.view.runs);
      blocks_of[r] = block_count(count, most);
      block_total += blocks_of[r];
    });
    // One behind the other, to be cleared and copied at one go.
    static_assert(sizeof(DeviceAccumulator) % alignof(BlockAccumulator) == 0);
    const std::size_t bytes = sizeof(DeviceAccumulator) + block_total * sizeof(BlockAccumulator);
    auto found = executor.allocate<unsigned char>(bytes);
    executor.clear(found.data(), bytes);
    auto* const accumulate = reinterpret_cast<DeviceAccumulator*>(found.data());
    auto* next = reinterpret_cast<BlockAccumulator*>(accumulate + 1);
    constexpr auto kKernel = &evaluate_kernel<Real>;
    constexpr std::size_t kHistogramBytes = 5 * kBinCount * sizeof(unsigned int);
    executor.allow_shared_memory<kKernel>(kHistogramBytes);
    std::vector<EvaluateTask> tasks;
    for_each_run(executor, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      const unsigned int grid = blocks_of[tasks.size()];
      tasks.push_back({run.shape, run.nodes, run.first, count, job.elements.caller_ids.data(),
                       orientation.references(), orientation.common(), job.fixed.data(), accumulate,
                       next});
      executor.launch_shared<kKernel>(grid, kHistogramBytes, tasks.back(), job.places.data());
      next += grid;
    });
    for (const EvaluateTask& task : tasks) {
      executor.launch<&list_worst_kernel<Real>>(block_count(task.count, 2 * most), task,
                                                job.places.data());
    }
    unsigned char* const copy = executor.lane().staging(bytes);
    executor.download_later(found.data(), copy, bytes);
    const std::size_t answered = executor.mark(executor.lane().stream);
    meanwhile();
    executor.wait_for(answered);
    executor.check();
    const auto& counted = *reinterpret_cast<const DeviceAccumulator*>(copy);
    const std::span blocks(reinterpret_cast<const BlockAccumulator*>(&counted + 1), block_total);
    std::vector<RankedElement> worst;
    if (counted.listed_count <= DeviceAccumulator::kMostListed) {
      worst.assign(counted.listed, counted.listed + counted.listed_count);
    } else {
      // Too many alike: one by one.
      for (const EvaluateTask& task : tasks) {
        RankedElement last{0, 0, RankedElement::kNoElement};
        for (std::size_t n = 0; n < kWorstCount; ++n) {
          last = find_next_worst(executor, task, job.places.data(), last);
          if (last.element == RankedElement::kNoElement) break;
          worst.push_back(last);
        }
      }
    }
    return to_report(counted, blocks, worst, job.elements.view);
  }

  [[nodiscard]] std::int64_t* moved() const {
    return executor_.lane().mapped<std::int64_t>(CudaExecutor::kMovedOffset);
  }

  [[nodiscard]] QualityReport to_report(const DeviceAccumulator& counted,
                                        std::span<const BlockAccumulator> blocks,
                                        const std::vector<RankedElement>& worst,
                                        const Elements& elements) const {
    auto total = std::make_unique<QualityAccumulator>();
    for (std::size_t m = 0; m < kMetricCount; ++m) {
      std::copy(std::begin(counted.bins[m]), std::end(counted.bins[m]), total->bins[m].begin());
      total->min[m] = from_ordered_bits(~counted.min[m]);
      total->max[m] = from_ordered_bits(counted.max[m]);
    }
    total->inverted = static_cast<std::int64_t>(counted.inverted);
    total->degenerate = static_cast<std::int64_t>(counted.degenerate);
    LockedStats locked{.element_count = static_cast<std::int64_t>(counted.locked),
                       .inverted_count = static_cast<std::int64_t>(counted.locked_inverted),
                       .worst = std::nullopt};
    ChunkSums sums;
    const auto name = [&](const RankedElement& e) {
      return ElementQuality{static_cast<std::int64_t>(e.element), type_of(e.element), e.mean_ratio,
                            e.scaled_jacobian};
    };
    for (const BlockAccumulator& block : blocks) {
      for (std::size_t m = 0; m < kMetricCount; ++m) sums.values[m] += block.sums.values[m];
      sums.volume += block.sums.volume;
      sums.enclosed_volume += block.sums.enclosed_volume;
      const RankedElement& e = block.worst_locked;
      if (e.element == RankedElement::kNoElement) continue;
      if (!locked.worst || worse(name(e), *locked.worst)) locked.worst = name(e);
    }
    for (const RankedElement& e : worst) total->keep_if_worst(name(e));
    return {summarize(*total, sums, static_cast<std::int64_t>(elements.count)), locked};
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
};

}  // namespace meshsmooth::detail
