#pragma once

#include "smooth/base/fixed_nodes.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cuda/base/warp.cuh"
#include "smooth/cuda/primitives/vector_access.cuh"
#include "smooth/cuda/topology/prepare_state.hpp"
#include "smooth/guard/sweep_context.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// How the balls of a job are found.
struct BallPlan {
  bool slotted;  // first into slots, a fixed number per node: large, but filled during the upload
  bool kept;     // in rows, beyond the search for rings

  static constexpr std::int64_t kSlots = 64;  // more elements than most nodes have

  static BallPlan of(const MeshSize& size, const JobPlan& plan) {
    constexpr std::int64_t kMostNodes = 1 << 17;  // below, the memory does not matter
    const auto tetrahedra = size.element_counts[static_cast<std::size_t>(ElementType::tetrahedron)];
    return {size.node_count <= kMostNodes && tetrahedra == count_mesh(size).elements,
            plan.needs_balls || size.regions};
  }
};

/// Balls in buckets of a fixed number of slots, interleaved by 32 nodes. No row start has to be
/// known, so that they are filled while later elements are still being uploaded.
struct BallSlots {
  static constexpr std::uint32_t kCount = BallPlan::kSlots;
  ElementId* entries = nullptr;
  const std::uint32_t* sizes = nullptr;  // may exceed kCount

  static constexpr std::size_t size(std::size_t node_count) {
    return (node_count + kWarp - 1) / kWarp * kWarp * kCount;
  }
  [[nodiscard]] __device__ ElementId* row(std::size_t node) const {
    return entries + (node / kWarp * kWarp * kCount + node % kWarp);
  }
};

/// Input and output of `ring_kernel`.
struct RingTask {
  std::size_t node_count;
  Elements elements;
  BallSlots slots;             // the balls, unless they are in rows already
  std::int64_t* ball_offsets;  // rows
  ElementId* ball_entries;
  const NodeId* caller_ids;             // of nodes
  const ElementId* element_caller_ids;  // null: the same ids
  bool keep_balls;                      // in rows, sorted
  std::int64_t* offsets;
  NodeId* entries;
  std::size_t capacity;           // of `entries`
  FixRule fix;                    // its marks are all 0 before
  unsigned long long* look_back;  // one word per block, 0 before
  PrepareState* state;
  PrepareState* host_state;  // mapped memory: receives a copy of the final state
};

/// The ball of a node.
class BallRow {
 public:
  __device__ BallRow(const RingTask& task, std::size_t node) {
    if (task.slots.entries != nullptr) {
      entries_ = task.slots.row(node);
      size_ = min(task.slots.sizes[node], BallSlots::kCount);
      stride_ = kWarp;
    } else {
      const std::int64_t begin = task.ball_offsets[node];
      entries_ = task.ball_entries + begin;
      size_ = static_cast<std::uint32_t>(task.ball_offsets[node + 1] - begin);
      stride_ = 1;
    }
  }
  [[nodiscard]] __device__ std::uint32_t size() const { return size_; }
  [[nodiscard]] __device__ ElementId operator[](std::uint32_t k) const {
    return entries_[std::size_t{k} * stride_];
  }

 private:
  const ElementId* entries_;
  std::uint32_t size_, stride_;
};

}  // namespace meshsmooth::detail
