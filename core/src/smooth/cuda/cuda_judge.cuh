#pragma once

#include <memory>

#include "mesh/measure.hpp"
#include "mesh/tally.hpp"
#include "smooth/cuda/cuda_topology.cuh"

namespace meshsmooth::detail {

/// An element as it is ranked: the lower, the worse.
struct RankedElement {
  double mean_ratio;
  double scaled_jacobian;
  ElementId element;  // the caller's; kNoElement: none

  static constexpr ElementId kNoElement = 0xffffffffU;

  [[nodiscard]] __device__ bool worse_than(const RankedElement& other) const {
    if (other.element == kNoElement) return element != kNoElement;
    if (element == kNoElement) return false;
    return mean_ratio != other.mean_ratio ? mean_ratio < other.mean_ratio
                                          : element < other.element;
  }
};

/// What all blocks count together; the order of counting does not matter.
struct DeviceTally {
  unsigned int bins[kMetricCount][kBinCount];
  unsigned long long min[kMetricCount], max[kMetricCount];  // ordered_bits
  unsigned long long inverted, degenerate, locked, locked_inverted;
};

/// What each block finds in the elements that it is given by the grid alone.
struct BlockTally {
  ChunkSums sums;
  RankedElement worst[kWorstCount];
  RankedElement worst_locked;
};

/// The elements of one type to judge.
struct JudgeTask {
  const ElementShape* shape;
  const NodeId* nodes;
  std::size_t first, count;
  const ElementId* names;        // of all elements, or null
  const PackedDirection* references;  // of all elements, or null: all have `reference`
  Vec3d reference;
  const std::uint8_t* fixed;
  DeviceTally* tally;
  BlockTally* blocks;
};

/// Elements per thread between two rankings.
inline constexpr int kJudgedAtOnce = 4;

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

/// The worst of one candidate per thread, for all threads.
__device__ inline RankedElement worst_of_block(RankedElement own, RankedElement* shared) {
  return reduce_block(own, shared, [](const RankedElement& a, const RankedElement& b) {
    return b.worse_than(a) ? b : a;
  });
}

template <class Real>
__global__ void __launch_bounds__(kBlockSize)
    judge_kernel(JudgeTask task, const Vec3<Real>* positions) {
  extern __shared__ unsigned int bins[];  // [metric of the type][bin]
  __shared__ RankedElement ranked[kBlockSize * kJudgedAtOnce];
  __shared__ RankedElement shared[kBlockSize];
  __shared__ RankedElement worst[kWorstCount];
  double* const shared_sums = reinterpret_cast<double*>(shared);
  const ElementShape& shape = *task.shape;
  const MetricsOfType metrics = metrics_of(shape);
  for (int i = static_cast<int>(threadIdx.x); i < metrics.count * int{kBinCount}; i += kBlockSize) {
    bins[i] = 0;
  }
  if (threadIdx.x < kWorstCount) worst[threadIdx.x].element = RankedElement::kNoElement;
  __syncthreads();

  const double infinity = HUGE_VAL;
  double sums[5] = {}, volume = 0;
  double min[5] = {infinity, infinity, infinity, infinity, infinity};
  double max[5] = {-infinity, -infinity, -infinity, -infinity, -infinity};
  unsigned int inverted = 0, degenerate = 0, locked = 0, locked_inverted = 0;
  RankedElement worst_locked{0, 0, RankedElement::kNoElement};
  constexpr std::size_t kChunk = std::size_t{kBlockSize} * kJudgedAtOnce;
  for (std::size_t chunk = blockIdx.x * kChunk; chunk < task.count;
       chunk += std::size_t{gridDim.x} * kChunk) {
#pragma unroll 1
    for (int turn = 0; turn < kJudgedAtOnce; ++turn) {
      const std::size_t at = turn * std::size_t{kBlockSize} + threadIdx.x;
      const std::size_t e = chunk + at;
      ranked[at].element = RankedElement::kNoElement;
      if (e >= task.count) continue;
      const std::size_t id = task.first + e;
      Vec3d corners[8];
      bool all_fixed = true;
      for (int n = 0; n < shape.node_count; ++n) {
        const NodeId node = task.nodes[e * static_cast<std::size_t>(shape.node_count) + n];
        corners[n] = vec3_cast<double>(positions[node]);
        all_fixed &= task.fixed[node] != 0;
      }
      const Vec3d reference = task.references == nullptr
                                  ? task.reference
                                  : unpack_direction(task.references[id]);
      const ElementMeasure m = measure_element(shape, corners, reference);
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
        const std::size_t metric = static_cast<std::size_t>(metrics.metrics[v]);
        atomicAdd(&bins[v * kBinCount + metric_bin(metric, values[v])], 1U);
      }
      volume += std::abs(m.volume);
      inverted += m.inverted ? 1 : 0;
      degenerate += m.degenerate ? 1 : 0;
      const RankedElement own{m.mean_ratio, m.scaled_jacobian,
                              task.names == nullptr ? static_cast<ElementId>(id)
                                                    : task.names[id]};
      ranked[at] = own;
      if (!all_fixed) continue;
      ++locked;
      locked_inverted += m.inverted ? 1 : 0;
      if (own.worse_than(worst_locked)) worst_locked = own;
    }
    __syncthreads();
    // As long as the chunk has a worse one than the least bad of the block's
    // worst, it takes that one's place.
    for (;;) {
      RankedElement best{0, 0, RankedElement::kNoElement};
      int best_at = 0;
      for (int turn = 0; turn < kJudgedAtOnce; ++turn) {
        const int at = turn * static_cast<int>(kBlockSize) + static_cast<int>(threadIdx.x);
        if (ranked[at].worse_than(best)) {
          best = ranked[at];
          best_at = at;
        }
      }
      const RankedElement found = worst_of_block(best, shared);
      int least = 0;
      for (int w = 1; w < int{kWorstCount}; ++w) {
        if (worst[least].worse_than(worst[w])) least = w;
      }
      const bool taken = found.worse_than(worst[least]);
      __syncthreads();
      if (!taken) break;
      if (best.element == found.element) ranked[best_at].element = RankedElement::kNoElement;
      if (threadIdx.x == 0) worst[least] = found;
      __syncthreads();
    }
  }

  BlockTally& own = task.blocks[blockIdx.x];
#pragma unroll
  for (int v = 0; v < 5; ++v) {
    if (v >= metrics.count) continue;
    const int metric = metrics.metrics[v];
    const double sum = sum_block(sums[v], shared_sums);
    const double least = reduce_block(min[v], shared_sums,
                                      [](double a, double b) { return a < b ? a : b; });
    const double most = reduce_block(max[v], shared_sums,
                                     [](double a, double b) { return a > b ? a : b; });
    if (threadIdx.x == 0) {
      own.sums.values[static_cast<std::size_t>(metric)] = sum;
      atomicMin(&task.tally->min[metric], ordered_bits(least));
      atomicMax(&task.tally->max[metric], ordered_bits(most));
    }
  }
  volume = sum_block(volume, shared_sums);
  const RankedElement locked_found = worst_of_block(worst_locked, shared);
  if (threadIdx.x == 0) {
    own.sums.volume = volume;
    own.worst_locked = locked_found;
  }
  if (threadIdx.x < kWorstCount) own.worst[threadIdx.x] = worst[threadIdx.x];
  const auto add = [](unsigned long long& total, unsigned int part) {
    if (part != 0) atomicAdd(&total, static_cast<unsigned long long>(part));
  };
  add(task.tally->inverted, inverted);
  add(task.tally->degenerate, degenerate);
  add(task.tally->locked, locked);
  add(task.tally->locked_inverted, locked_inverted);
  for (int v = 0; v < metrics.count; ++v) {
    for (int b = static_cast<int>(threadIdx.x); b < int{kBinCount}; b += kBlockSize) {
      const unsigned int count = bins[v * int{kBinCount} + b];
      if (count != 0) atomicAdd(&task.tally->bins[metrics.metrics[v]][b], count);
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
  const ElementId* const caller_of = elements.caller_of.data();
  executor.for_each(elements.view.count,
                    [=] __device__(std::size_t e) { to[e] = from[caller_of[e]]; });
  return ordered;
}

/// Judges a job on its device, in internal order, and gives the caller's ids back.
class CudaJudge {
 public:
  CudaJudge(CudaExecutor& executor, const TopologyView& topology, PositionsView positions)
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
      if (elements.caller_of.size() != 0) normals_ = in_order(executor, normals_, elements);
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
    CudaExecutor& executor = executor_;
    auto tally_buffer = executor.allocate<DeviceTally>(1);
    DeviceTally* const tally = tally_buffer.data();
    executor.clear(tally, 1);
    check_cuda(cudaMemsetAsync(tally->min, 0xff, sizeof tally->min, executor.stream()),
               "clearing device memory");
    unsigned int blocks_of[kElementTypeCount];
    unsigned int block_total = 0;
    const auto most = 2 * static_cast<std::size_t>(executor.lane().multiprocessor_count());
    for_each_run(executor, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      const auto r = static_cast<std::size_t>(&run - job.elements.view.runs);
      const std::size_t chunk = std::size_t{kBlockSize} * kJudgedAtOnce;
      blocks_of[r] = static_cast<unsigned int>(
          std::clamp<std::size_t>((count + chunk - 1) / chunk, 1, most));
      block_total += blocks_of[r];
    });
    auto blocks = executor.allocate<BlockTally>(block_total);
    executor.clear(blocks.data(), block_total);
    constexpr auto kKernel = &judge_kernel<Real>;
    static const bool allowed = [] {
      check_cuda(cudaFuncSetAttribute(kKernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                      5 * kBinCount * sizeof(unsigned int)),
                 "asking for shared memory");
      return true;
    }();
    static_cast<void>(allowed);
    BlockTally* next = blocks.data();
    for_each_run(executor, job.elements, [&]<int>(const Elements::Run& run, std::size_t count) {
      const auto r = static_cast<std::size_t>(&run - job.elements.view.runs);
      const JudgeTask task{run.shape,
                           run.nodes,
                           run.first,
                           count,
                           job.elements.caller_of.data(),
                           orientation.references(),
                           orientation.common(),
                           job.fixed.data(),
                           tally,
                           next};
      executor.launch_shared<kKernel>(
          blocks_of[r], 5 * kBinCount * sizeof(unsigned int), task, job.places.data());
      next += blocks_of[r];
    });
    auto counted = std::make_unique<DeviceTally>();
    std::vector<BlockTally> found(block_total);
    check_cuda(cudaMemcpyAsync(counted.get(), tally, sizeof(DeviceTally), cudaMemcpyDeviceToHost,
                               executor.stream()),
               "copying from the device");
    executor.download(blocks.data(), block_total, found.data());
    executor.check();
    return to_stats(*counted, found, job.elements.view);
  }

  /// Of the last `quality`.
  template <class Real>
  [[nodiscard]] LockedStats locked(const Mesh<Real>&, const Orientation&) const {
    return locked_;
  }

  /// All positions in the caller's order; returns how many differ from the input.
  template <class Real>
  std::int64_t write_back(Mesh<Real>& job, std::span<Vec3<Real>> positions) const {
    Vec3<Real>* const given = job.given.data();
    const Vec3<Real>* const places = job.places.data();
    const NodeId* const caller_of = job.caller_of.data();
    const std::uint8_t* const fixed = job.fixed.data();
    const std::int64_t moved = executor_.reduce(
        job.node_count, std::int64_t{0},
        [=] __device__(std::size_t node) -> std::int64_t {
          Vec3<Real>& target = given[caller_of[node]];
          if (fixed[node] != 0 || places[node] == target) return 0;
          target = places[node];
          return 1;
        },
        [] __device__(std::int64_t a, std::int64_t b) { return a + b; });
    executor_.download(given, positions.size(), positions.data());
    return moved;
  }

 private:
  QualityStats to_stats(const DeviceTally& counted, const std::vector<BlockTally>& blocks,
                        const Elements& elements) {
    auto total = std::make_unique<Tally>();
    for (std::size_t m = 0; m < kMetricCount; ++m) {
      std::copy(std::begin(counted.bins[m]), std::end(counted.bins[m]), total->bins[m].begin());
      total->min[m] = from_ordered_bits(counted.min[m]);
      total->max[m] = from_ordered_bits(counted.max[m]);
    }
    total->inverted = static_cast<std::int64_t>(counted.inverted);
    total->degenerate = static_cast<std::int64_t>(counted.degenerate);
    locked_ = {.element_count = static_cast<std::int64_t>(counted.locked),
               .inverted_count = static_cast<std::int64_t>(counted.locked_inverted),
               .worst = std::nullopt};
    ChunkSums sums;
    const auto name = [&](const RankedElement& e) {
      return ElementQuality{e.element, type_of(e.element), e.mean_ratio, e.scaled_jacobian};
    };
    for (const BlockTally& block : blocks) {
      for (std::size_t m = 0; m < kMetricCount; ++m) sums.values[m] += block.sums.values[m];
      sums.volume += block.sums.volume;
      for (const RankedElement& e : block.worst) {
        if (e.element != RankedElement::kNoElement) total->keep_if_worst(name(e));
      }
      const RankedElement& e = block.worst_locked;
      if (e.element == RankedElement::kNoElement) continue;
      if (!locked_.worst || worse(name(e), *locked_.worst)) locked_.worst = name(e);
    }
    return summarize(std::move(*total), sums, static_cast<std::int64_t>(elements.count));
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
  LockedStats locked_;
};

}  // namespace meshsmooth::detail
