#pragma once

#include <type_traits>

#include "smooth/cuda/topology/ring_task.cuh"
#include "smooth/cuda/topology/shared_rows.cuh"

namespace meshsmooth::detail {

/// Moves the balls of a block's nodes from their slots into their rows, if they are in slots, and
/// sorts each by the caller's element ids; all threads call. Rows are staged in shared memory,
/// where a thread sorts a short one and a warp a long one; what a warp cannot stage it sorts in
/// place.
__device__ inline void sort_balls(const RingTask& task, std::size_t first, RowEntries& rows,
                                  RowEntries& scratch) {
  const std::size_t own = first + threadIdx.x;
  const bool mine = own < task.node_count;
  const unsigned int lane = threadIdx.x % kWarp;
  const std::int64_t begin = task.ball_offsets[mine ? own : task.node_count];
  const auto size =
      static_cast<unsigned int>(mine ? task.ball_offsets[own + 1] - begin : std::int64_t{0});
  const std::int64_t warp_begin = __shfl_sync(kAllLanes, begin, 0);
  const auto start = static_cast<unsigned int>(begin - warp_begin);
  const unsigned int total = __shfl_sync(kAllLanes, start + size, kWarp - 1);
  ElementId* const entries = task.ball_entries + warp_begin;
  const ElementId* const caller_ids = task.element_caller_ids;
  const bool slotted = task.slots.entries != nullptr;
  const auto fetch_slots = [&](auto* to) {
    if (!slotted || !mine) return;
    const BallRow ball(task, own);
    for (unsigned int k = 0; k < ball.size(); ++k) {
      to[start + k] = static_cast<std::remove_reference_t<decltype(*to)>>(ball[k]);
    }
  };
  __syncthreads();  // the shared memory is free
  if (total > kStaged || task.elements.count >= kTooManyKeys) {
    fetch_slots(entries);
    __syncwarp();
    for (int r = 0; r < kWarp; ++r) {
      sort_by_warp(entries + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r),
                   [=](ElementId e) { return caller_ids == nullptr ? e : caller_ids[e]; });
    }
    return;
  }
  int* const staged = stage_of_warp(scratch);
  fetch_slots(staged);
  for (unsigned int i = lane; i < total && !slotted; i += kWarp) {
    staged[i] = static_cast<int>(entries[i]);
  }
  __syncwarp();
  const auto key = [=](int e) {
    return caller_ids == nullptr ? static_cast<ElementId>(e)
                                 : caller_ids[static_cast<ElementId>(e)];
  };
  const unsigned int own_size = size <= kRowCapacity ? size : 0;  // of a short row
  const bool wide = __any_sync(kAllLanes, own_size > kRowCapacity / 2) != 0;
  for (unsigned int k = 0; k < own_size; ++k) rows[k][threadIdx.x] = staged[start + k];
  sort_own_row(rows, scratch, static_cast<int>(own_size), wide, task.elements.count, key);
  for (unsigned int k = 0; k < own_size; ++k) staged[start + k] = rows[k][threadIdx.x];
  __syncwarp();
  for (unsigned int left = __ballot_sync(kAllLanes, own_size < size); left != 0; left &= left - 1) {
    const int r = __ffs(static_cast<int>(left)) - 1;
    sort_by_warp(staged + __shfl_sync(kAllLanes, start, r), __shfl_sync(kAllLanes, size, r), key);
  }
  for (unsigned int i = lane; i < total; i += kWarp) entries[i] = static_cast<ElementId>(staged[i]);
}

}  // namespace meshsmooth::detail
