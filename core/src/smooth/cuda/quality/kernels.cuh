#pragma once

#include <cub/block/block_scan.cuh>

#include "smooth/cuda/quality/task.cuh"

namespace meshsmooth::detail {

/// How many metrics of a type the kernels count. A brief evaluation needs the mean ratio alone, to
/// find the worst elements; without the others the compiler drops their computation.
template <QualityDetail kDetail>
inline constexpr int kCountedMetrics = kDetail == QualityDetail::brief ? 1 : kMostMetrics;

/// The counts and sums of one thread.
template <int kMetrics>
struct ThreadAccumulator {
  double sums[kMetrics] = {}, volume = 0, enclosed = 0;
  double min[kMetrics], max[kMetrics];
  unsigned int inverted = 0, degenerate = 0, locked = 0, locked_inverted = 0;
  RankedElement worst_locked{0, 0, RankedElement::kNoElement};

  __device__ ThreadAccumulator() {
    for (int v = 0; v < kMetrics; ++v) {
      min[v] = HUGE_VAL;
      max[v] = -HUGE_VAL;
    }
  }

  /// `bins` are the block's histograms, [metric of the type][bin]. Returns the bin of the first
  /// metric, the mean ratio.
  __device__ std::uint16_t add(const ElementMeasure& m, const ElementShape& shape,
                               const MetricsOfType& metrics, unsigned int* bins) {
    static_assert(kBinCount - 1 <= UINT16_MAX);
    std::uint16_t first_bin = 0;
    double values[kMostMetrics] = {};
    for_each_metric(shape, m, [&](int v, QualityMetric, double value) { values[v] = value; });
#pragma unroll
    for (int v = 0; v < kMetrics; ++v) {
      if (v >= metrics.count) continue;
      if (!isfinite(values[v])) values[v] = 0;
      sums[v] += values[v];
      min[v] = values[v] < min[v] ? values[v] : min[v];
      max[v] = values[v] > max[v] ? values[v] : max[v];
      const auto metric = static_cast<std::size_t>(metrics.metrics[v]);
      const std::size_t bin = metric_bin(metric, values[v]);
      if (v == 0) first_bin = static_cast<std::uint16_t>(bin);
      atomicAdd(&bins[v * kBinCount + bin], 1U);
    }
    volume += std::abs(m.volume);
    if (shape.dimension == 3) enclosed += m.volume;
    inverted += m.inverted ? 1 : 0;
    degenerate += m.degenerate ? 1 : 0;
    return first_bin;
  }
  __device__ void add_locked(const ElementMeasure& m, const RankedElement& own) {
    ++locked;
    locked_inverted += m.inverted ? 1 : 0;
    if (own.worse_than(worst_locked)) worst_locked = own;
  }
};

/// Folds the threads' sums, minima and maxima and stores them; all threads call.
template <int kMetrics>
__device__ void store_sums(const EvaluateTask& task, const MetricsOfType& metrics,
                           const ThreadAccumulator<kMetrics>& thread, double* shared,
                           RankedElement* shared_ranked) {
  const auto sum = [&](double value) {
    return reduce_block(value, shared, [](double a, double b) { return a + b; });
  };
  BlockAccumulator& own = task.blocks[blockIdx.x];
#pragma unroll
  for (int v = 0; v < kMetrics; ++v) {
    if (v >= metrics.count) continue;
    const int metric = metrics.metrics[v];
    const double total = sum(thread.sums[v]);
    const double least =
        reduce_block(thread.min[v], shared, [](double a, double b) { return a < b ? a : b; });
    const double most =
        reduce_block(thread.max[v], shared, [](double a, double b) { return a > b ? a : b; });
    if (threadIdx.x == 0) {
      own.sums.values[static_cast<std::size_t>(metric)] = total;
      atomicMax(&task.accumulator->min[metric], ~ordered_bits(least));
      atomicMax(&task.accumulator->max[metric], ordered_bits(most));
    }
  }
  const double volume = sum(thread.volume), enclosed = sum(thread.enclosed);
  const RankedElement worst_locked = reduce_block(
      thread.worst_locked, shared_ranked,
      [](const RankedElement& a, const RankedElement& b) { return b.worse_than(a) ? b : a; });
  if (threadIdx.x != 0) return;
  own.sums.volume = volume;
  own.sums.enclosed_volume = enclosed;
  own.worst_locked = worst_locked;
}

/// Quality measures of all elements of one type: histograms, sums, extrema, counts.
/// grid   blocks of kBlockSize, four per multiprocessor
/// shared histograms (dynamic, kHistogramBytes<kDetail>) and a value per thread
/// needs  the accumulators all 0
/// order  deterministic: counts and extrema by atomics, sums by a fixed tree per block
/// fast   80 us at 100k (H200): double precision, histograms in shared memory
/// equals `measure_quality` of the mesh library, up to the grouping of sums
template <class Real, QualityDetail kDetail, bool kTetrahedra>
__global__ void __launch_bounds__(kBlockSize, 2)
    evaluate_kernel(EvaluateTask task, const Vec3<Real>* positions) {
  extern __shared__ unsigned int bins[];  // [metric of the type][bin]
  __shared__ double shared[kBlockSize];
  __shared__ RankedElement shared_ranked[kBlockSize];
  const ElementShape& shape = *task.shape;
  constexpr int kMetrics = kCountedMetrics<kDetail>;
  MetricsOfType metrics = metrics_of(shape);
  metrics.count = min(metrics.count, kMetrics);
  for (int i = static_cast<int>(threadIdx.x); i < metrics.count * int{kBinCount}; i += kBlockSize) {
    bins[i] = 0;
  }
  __syncthreads();

  ThreadAccumulator<kMetrics> thread;
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t e = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; e < task.count;
       e += step) {
    const ElementMeasure m = measure_in<kTetrahedra>(task, shape, positions, e);
    task.mean_ratio_bins[e] = thread.add(m, shape, metrics, bins);
    bool locked = true;
    for (int n = 0; n < shape.node_count; ++n) locked &= task.fixed[task.node(shape, e, n)] != 0;
    if (locked) thread.add_locked(m, ranked(task, e, m));
  }
  store_sums(task, metrics, thread, shared, shared_ranked);
  const auto add = [](unsigned long long& total, unsigned int part) {
    if (part != 0) atomicAdd(&total, static_cast<unsigned long long>(part));
  };
  add(task.accumulator->inverted, thread.inverted);
  add(task.accumulator->degenerate, thread.degenerate);
  add(task.accumulator->locked, thread.locked);
  add(task.accumulator->locked_inverted, thread.locked_inverted);
  for (int v = 0; v < metrics.count; ++v) {
    for (int b = static_cast<int>(threadIdx.x); b < int{kBinCount}; b += kBlockSize) {
      const unsigned int count = bins[v * int{kBinCount} + b];
      if (count != 0) atomicAdd(&task.accumulator->bins[metrics.metrics[v]][b], count);
    }
  }
}
template <QualityDetail kDetail>
inline constexpr std::size_t kHistogramBytes = kCountedMetrics<kDetail>* kBinCount *
                                               sizeof(unsigned int);

/// Lists the elements in the lowest bins of the mean ratio that together hold kWorstCount; keeps
/// counting after the list is full.
/// grid   blocks of kBlockSize, eight per multiprocessor
/// shared CUB's scan
/// needs  the histograms of `evaluate_kernel`, of all types, and the bins of the elements
/// order  the list is unordered, its content deterministic unless it is full
/// fast   measures the few in those bins only
/// equals the worst elements of `measure_quality`, once ranked by the host
template <class Real, bool kTetrahedra>
__global__ void __launch_bounds__(kBlockSize)
    list_worst_kernel(EvaluateTask task, const Vec3<Real>* positions) {
  using Scan = cub::BlockScan<unsigned int, kBlockSize>;
  __shared__ typename Scan::TempStorage scan_space;
  __shared__ unsigned int shared_bin;
  constexpr unsigned int kEach = kBinCount / kBlockSize;
  const unsigned int first = threadIdx.x * kEach;
  unsigned int own = 0, below = 0;
  for (unsigned int b = first; b < first + kEach; ++b) own += task.accumulator->bins[0][b];
  if (threadIdx.x == 0) shared_bin = kBinCount - 1;
  Scan(scan_space).ExclusiveSum(own, below);
  __syncthreads();
  if (below < kWorstCount && below + own >= kWorstCount) {
    unsigned int bin = first;
    while ((below += task.accumulator->bins[0][bin]) < kWorstCount) ++bin;
    shared_bin = bin;
  }
  __syncthreads();
  const unsigned int highest = shared_bin;
  if (blockIdx.x == 0 && threadIdx.x == 0) task.accumulator->highest_bin = highest;
  const ElementShape& shape = *task.shape;
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t e = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; e < task.count;
       e += step) {
    if (task.mean_ratio_bins[e] > highest) continue;
    const unsigned int at = atomicAdd(&task.accumulator->listed_count, 1U);
    if (at >= DeviceAccumulator::kMostListed) continue;
    const ElementMeasure m = measure_in<kTetrahedra>(task, shape, positions, e);
    task.accumulator->listed[at] = ranked(task, e, m);
  }
}

}  // namespace meshsmooth::detail
