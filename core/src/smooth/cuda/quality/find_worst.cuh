#pragma once

#include <algorithm>
#include <vector>

#include "smooth/cuda/quality/task.cuh"

namespace meshsmooth::detail {

/// The worst element of each block's share, by the bins of `evaluate_kernel`.
/// grid   any number of blocks of kBlockSize, a value in `worst` for each
/// shared a value per thread
/// order  deterministic
template <class Real>
__global__ void __launch_bounds__(kBlockSize)
    worst_of_blocks_kernel(EvaluateTask task, const Vec3<Real>* positions, RankedElement* worst) {
  __shared__ RankedElement shared[kBlockSize];
  const ElementShape& shape = *task.shape;
  RankedElement own{0, 0, RankedElement::kNoElement};
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t e = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; e < task.count;
       e += step) {
    if (!task.may_be_worst(e)) continue;
    const RankedElement other = ranked(task, e, measure_in<false>(task, shape, positions, e));
    if (other.worse_than(own)) own = other;
  }
  own = reduce_block(own, shared, [](const RankedElement& a, const RankedElement& b) {
    return b.worse_than(a) ? b : a;
  });
  if (threadIdx.x == 0) worst[blockIdx.x] = own;
}

/// Adds the elements that are no better than `bound` to the list, which it keeps counting.
template <class Real>
void list_up_to(CudaExecutor& executor, const EvaluateTask& task, const Vec3<Real>* positions,
                RankedElement bound) {
  executor.for_each(task.count, [=] __device__(std::size_t e) {
    if (!task.may_be_worst(e)) return;
    const RankedElement own = ranked(task, e, measure_in<false>(task, *task.shape, positions, e));
    if (bound.worse_than(own)) return;
    const unsigned int at = atomicAdd(&task.accumulator->listed_count, 1U);
    if (at < DeviceAccumulator::kMostListed) task.accumulator->listed[at] = own;
  });
}

/// The worst of all elements that are better than `after`.
template <class Real>
RankedElement find_next_worst(CudaExecutor& executor, const EvaluateTask& task,
                              const Vec3<Real>* positions, RankedElement after) {
  return executor.reduce(
      task.count, RankedElement{0, 0, RankedElement::kNoElement},
      [=] __device__(std::size_t e) -> RankedElement {
        if (!task.may_be_worst(e)) return {0, 0, RankedElement::kNoElement};
        const RankedElement own =
            ranked(task, e, measure_in<false>(task, *task.shape, positions, e));
        const bool later = after.element == RankedElement::kNoElement || after.worse_than(own);
        return later ? own : RankedElement{0, 0, RankedElement::kNoElement};
      },
      [] __device__(const RankedElement& a, const RankedElement& b) -> RankedElement {
        return b.worse_than(a) ? b : a;
      });
}

/// An element that is no better than the last of the kWorstCount worst ones, by the worst of each
/// block's share; none where there are fewer blocks.
template <class Real>
[[nodiscard]] RankedElement bound_worst(CudaExecutor& executor,
                                        const std::vector<EvaluateTask>& tasks,
                                        const Vec3<Real>* positions) {
  constexpr std::size_t kMostBlocks = 1024;
  std::vector<RankedElement> worst;
  for (const EvaluateTask& task : tasks) {
    const unsigned int blocks = block_count(task.count, kMostBlocks);
    auto found = executor.allocate<RankedElement>(blocks);
    launch<&worst_of_blocks_kernel<Real>>(executor.stream(), {blocks}, task, positions,
                                          found.data());
    const std::size_t first = worst.size();
    worst.resize(first + blocks);
    executor.download(found.data(), blocks, worst.data() + first);
  }
  executor.check();
  if (worst.size() < kWorstCount) return {0, 0, RankedElement::kNoElement};
  const auto last = worst.begin() + (kWorstCount - 1);
  std::ranges::nth_element(
      worst, last, [](const RankedElement& a, const RankedElement& b) { return a.worse_than(b); });
  return *last;
}

/// The worst elements and perhaps others, unordered.
///
/// takes  what the kernels counted, in host memory
/// cost   nothing more where their list is not full; else two passes over the elements of the
///        lowest bins, as in regular meshes, where many share them; a pass for each where very many
///        are equal
template <class Real>
[[nodiscard]] std::vector<RankedElement> find_worst(CudaExecutor& executor,
                                                    const DeviceAccumulator& counted,
                                                    const std::vector<EvaluateTask>& tasks,
                                                    const Vec3<Real>* positions) {
  const auto fits = [](unsigned int count) { return count <= DeviceAccumulator::kMostListed; };
  if (fits(counted.listed_count)) return {counted.listed, counted.listed + counted.listed_count};
  DeviceAccumulator* const accumulator = tasks.front().accumulator;
  const RankedElement bound = bound_worst(executor, tasks, positions);
  executor.clear(&accumulator->listed_count, 1);
  for (const EvaluateTask& task : tasks) list_up_to(executor, task, positions, bound);
  unsigned int count = 0;
  std::vector<RankedElement> worst(DeviceAccumulator::kMostListed);
  executor.download_later(&accumulator->listed_count, &count);
  executor.download(accumulator->listed, worst.size(), worst.data());
  if (fits(count)) {
    worst.resize(count);
    return worst;
  }
  worst.clear();
  for (const EvaluateTask& task : tasks) {
    RankedElement last{0, 0, RankedElement::kNoElement};
    for (std::size_t n = 0; n < kWorstCount; ++n) {
      last = find_next_worst(executor, task, positions, last);
      if (last.element == RankedElement::kNoElement) break;
      worst.push_back(last);
    }
  }
  return worst;
}

}  // namespace meshsmooth::detail
