#pragma once

#include "mesh/accumulator.hpp"
#include "mesh/measure.hpp"
#include "mesh/metric_columns.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cuda/primitives/executor.cuh"

namespace meshsmooth::detail {

/// An element in the order of quality, the worst first.
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

/// Counts of all blocks, whose order does not matter.
struct DeviceAccumulator {
  unsigned int bins[kMetricCount][kBinCount];  // which the host reads of a full evaluation only
  // ordered_bits; minima complemented, so that atomicMax serves both and both start at 0
  unsigned long long min[kMetricCount], max[kMetricCount];
  unsigned long long inverted, degenerate, locked, locked_inverted;
  unsigned int highest_bin;  // of the mean ratio, in which a worst element may be
  unsigned int listed_count;
  static constexpr unsigned int kMostListed = 256;
  RankedElement listed[kMostListed];  // include the worst
};

/// Sums of one block, over elements that depend on the grid alone.
struct BlockAccumulator {
  ChunkSums sums;
  RankedElement worst_locked;
};

/// The elements of one type to evaluate.
struct EvaluateTask {
  const ElementShape* shape;
  const NodeId* nodes;
  std::size_t first, count;
  const ElementId* caller_ids;        // of all elements, or null
  const PackedDirection* references;  // of all elements, or null: all have `reference`
  Vec3d reference;
  const std::uint8_t* fixed;
  DeviceAccumulator* accumulator = nullptr;
  BlockAccumulator* blocks = nullptr;
  std::uint16_t* mean_ratio_bins = nullptr;  // of the task's elements

  [[nodiscard]] __device__ NodeId node(const ElementShape& type, std::size_t e, int n) const {
    return nodes[e * static_cast<std::size_t>(type.node_count) + n];
  }
  /// Of an evaluated element.
  [[nodiscard]] __device__ bool may_be_worst(std::size_t e) const {
    return mean_ratio_bins[e] <= accumulator->highest_bin;
  }
  [[nodiscard]] __device__ ElementId caller_id(std::size_t e) const {
    return caller_ids == nullptr ? static_cast<ElementId>(first + e) : caller_ids[first + e];
  }
};

/// The quality measures of an element of a task, in double. Code for tetrahedra alone needs few
/// registers.
template <bool kTetrahedra, class Real>
__device__ ElementMeasure measure_in(const EvaluateTask& task, const ElementShape& shape,
                                     const Vec3<Real>* positions, std::size_t e) {
  Vec3d corners[kTetrahedra ? 4 : kMaxCorners];
  for (int n = 0; n < (kTetrahedra ? 4 : shape.node_count); ++n) {
    corners[n] = vec3_cast<double>(positions[task.node(shape, e, n)]);
  }
  if constexpr (kTetrahedra) {
    return measure_tetrahedron(corners);
  } else {
    const Vec3d reference = task.references == nullptr
                                ? task.reference
                                : unpack_direction(task.references[task.first + e]);
    return measure_element(shape, corners, reference);
  }
}
__device__ inline RankedElement ranked(const EvaluateTask& task, std::size_t e,
                                       const ElementMeasure& m) {
  return {finite_measure(m.mean_ratio), finite_measure(m.scaled_jacobian), task.caller_id(e)};
}

/// Stores metrics of the elements of a task.
template <class Real>
struct StoreMetrics {
  EvaluateTask task;
  const Vec3<Real>* positions;
  MetricColumns columns;

  __device__ void operator()(std::size_t e) const {
    columns.store(*task.shape, measure_in<false>(task, *task.shape, positions, e),
                  task.caller_id(e));
  }
};

}  // namespace meshsmooth::detail
