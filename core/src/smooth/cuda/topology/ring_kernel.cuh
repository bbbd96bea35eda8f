#pragma once

#include "smooth/cuda/topology/balls.cuh"
#include "smooth/cuda/topology/ring_block.cuh"

namespace meshsmooth::detail {

/// Decides whether the block's nodes are fixed, one per thread, and counts them; all threads call.
/// kNodes: see `ring_kernel`.
template <int kNodes>
__device__ inline void fix_own(const RingTask& task, std::size_t own, int degree) {
  FixedCounts counts;
  if (own < task.node_count) counts = task.fix(own, degree == 0);
  const auto add = [](unsigned long long& total, bool counted) {
    const int count = __syncthreads_count(counted);
    if (threadIdx.x == 0 && count > 0) atomicAdd(&total, static_cast<unsigned long long>(count));
  };
  add(task.state->boundary, counts.nodes.boundary != 0);
  add(task.state->fixed, counts.nodes.fixed != 0);
  add(task.state->isolated, counts.nodes.isolated != 0);
  if constexpr (kNodes != 4) {
    add(task.state->on_non_manifold_edges, counts.nodes.on_non_manifold_edges != 0);
  }
  add(task.state->free, counts.free != 0);
}

/// The block that ends last copies the state to the host. One thread of each block calls, after all
/// of the block's updates.
__device__ inline void end_block(const RingTask& task) {
  __threadfence();
  if (atomicAdd(&task.state->blocks_done, 1U) + 1 != gridDim.x) return;
  __threadfence();
  using Word = unsigned long long;
  static_assert(sizeof(PrepareState) % sizeof(Word) == 0);
  const volatile Word* const from = reinterpret_cast<const volatile Word*>(task.state);
  for (std::size_t w = 0; w < sizeof(PrepareState) / sizeof(Word); ++w) {
    reinterpret_cast<Word*>(task.host_state)[w] = from[w];
  }
}

/// Rings, boundary, fixed nodes and, where they are kept, sorted balls, in one pass: search, count,
/// sort, look back, store.
///
/// kNodes  of the only element type, a simplex, whose short rows are found by one thread each; else
///         0. kBlocks: per multiprocessor; 6 cost registers and pay where the mesh is so small that
///         all blocks are resident at once.
/// grid    a block of kRowsPerBlock threads per kRowsPerBlock nodes
/// shared  about 33 KiB, static
/// needs   the balls; the look-back's words, the marks and the counts all 0
/// order   deterministic: rows are sorted by the caller's ids
/// fast    a row is searched in shared memory and written once, by coalesced stores; no kernel
///         waits for a scan. 70 us at 100k (34 us is a block's average, 58 the slowest's), of
///         785 us at 1M (H200). A thread per node instead of a warp: 190 to 84 us.
/// equals  `find_rings`, `find_boundary` and `fix_nodes` of the CPU backend
template <int kNodes, int kBlocks = 5>
__global__ void __launch_bounds__(kRowsPerBlock, kBlocks) ring_kernel(RingTask task) {
  __shared__ RingBlock<kNodes> shared;
  const unsigned int t = threadIdx.x, warp = t / kWarp, lane = t % kWarp;
  const unsigned int block = shared.begin(task);
  const std::size_t first = std::size_t{block} * kRowsPerBlock;
  const std::size_t own = first + t;
  const bool mine = own < task.node_count;
  if (task.state->wrong_element != 0 || task.state->overfull_ball != 0) {
    if (mine) task.offsets[own] = task.offsets[own + 1] = 0;
    if (t == 0) end_block(task);
    return;
  }

  unsigned int searched = t;  // whose row the thread searches and sorts; it stores its own
  if constexpr (kNodes != 0) searched = balance_by_ball_size(task, first, block);
  shared.search(task, first, searched);
  const int degree = shared.degrees[t];
  fix_own<kNodes>(task, own, degree);
  const BlockPrefix<unsigned int> prefix =
      scan_block(static_cast<unsigned int>(degree), shared.kWarps, shared.warp_totals);
  // Published before the sort: later blocks wait for it.
  const LookBack look_back(task.look_back, block);
  if (t == 0) look_back.publish(prefix.total);
  shared.sort(task, searched);
  if (warp == 0) {
    __syncwarp();
    const unsigned long long before = look_back.sum_before(prefix.total);
    if (lane == 0) shared.base = before;
  }
  __syncthreads();
  const unsigned long long warp_start = shared.base + prefix.before_warp;
  const unsigned long long start = warp_start + prefix.in_warp;
  if (mine) task.offsets[own] = static_cast<std::int64_t>(start);
  if (own + 1 == task.node_count) {
    task.offsets[own + 1] = static_cast<std::int64_t>(start + degree);
    task.state->ring_entries = start + degree;
  }
  // Else the host learns of it and launches again.
  const bool room = shared.base + prefix.total <= task.capacity;
  const bool all_short = __syncthreads_and(shared.parts[t] == 0) != 0;
  if (t == 0) end_block(task);
  if (room && all_short) {
    store_rows(shared.rows, shared.columns[t], shared.scratch.entries, task.entries + warp_start,
               prefix.in_warp, static_cast<unsigned int>(degree));
  } else if (room) {
    shared.store_mixed(task, first, start, degree);
  }
  if (task.keep_balls) sort_balls(task, first, shared.rows, shared.scratch.entries);
}

/// Launches `ring_kernel` with room for `capacity` ring entries. `fix.fixed` must be all 0, and so
/// must the counts of the state, a copy of which is in mapped memory at the next `synchronize`.
inline RowBuffer<CudaExecutor, NodeId> find_rings(CudaExecutor& executor, std::size_t node_count,
                                                  const JobElements<CudaExecutor>& elements,
                                                  FoundBalls& balls, bool keep_balls,
                                                  std::size_t capacity, const FixRule& fix,
                                                  PrepareState* state) {
  const std::size_t blocks = (node_count + kRowsPerBlock - 1) / kRowsPerBlock;
  RowBuffer<CudaExecutor, NodeId> rings;
  rings.offsets = executor.allocate<std::int64_t>(node_count + 1);
  rings.entries = executor.allocate<NodeId>(capacity);
  auto words = executor.allocate<unsigned long long>(blocks);
  executor.clear(words.data(), blocks);
  const RingTask task{node_count,
                      elements.view,
                      balls.in_slots(),
                      balls.rows.offsets.data(),
                      balls.rows.entries.data(),
                      fix.caller_ids,
                      elements.caller_ids.data(),
                      keep_balls,
                      rings.offsets.data(),
                      rings.entries.data(),
                      capacity,
                      fix,
                      words.data(),
                      state,
                      executor.lane().mapped<PrepareState>(CudaLane::kStateOffset)};
  const Grid grid{static_cast<unsigned int>(blocks), kRowsPerBlock};
  const bool packable = node_count < kTooManyKeys;
  if (packable && is_only(executor, elements.view, ElementType::tetrahedron)) {
    constexpr int kMany = 6;
    if (blocks <= kMany * static_cast<std::size_t>(executor.lane().multiprocessor_count())) {
      launch<&ring_kernel<4, kMany>>(executor.stream(), grid, task);
    } else {
      launch<&ring_kernel<4>>(executor.stream(), grid, task);
    }
  } else if (packable && is_only(executor, elements.view, ElementType::triangle)) {
    launch<&ring_kernel<3>>(executor.stream(), grid, task);
  } else {
    launch<&ring_kernel<0>>(executor.stream(), grid, task);
  }
  return rings;
}

}  // namespace meshsmooth::detail
