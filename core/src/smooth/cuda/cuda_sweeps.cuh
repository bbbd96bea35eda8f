#pragma once

#include <cooperative_groups.h>

#include <chrono>

#include "smooth/cuda/cuda_executor.cuh"
#include "smooth/iterate.hpp"

namespace meshsmooth::detail {

/// Sweeps done at one go by a kernel whose blocks wait for each other.
struct SweepBatch {
  int most;           // sweeps
  double tolerance;   // ends when the largest move is below
  unsigned long long* largest;  // a word per sweep, 0 before: bits of the squared move
  SweepStats* partial;          // [sweep][block]
  SweepStats* stats;            // [sweep], host memory
  int* done;                    // sweeps done, host memory
};

inline constexpr int kMostInBatch = 64;

/// Folds what the threads of a block have seen of a sweep, and tells the other
/// blocks the largest move.
__device__ inline void publish(const SweepBatch& batch, int sweep, SweepStats seen,
                               SweepStats* shared) {
  seen = reduce_block(seen, shared, AddStats{});
  if (threadIdx.x != 0) return;
  batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + blockIdx.x] = seen;
  if (seen.moved == 0) return;
  // A move whose square is 0 is still a move.
  const auto bits = static_cast<unsigned long long>(__double_as_longlong(seen.max_squared));
  atomicMax(&batch.largest[sweep], bits > 0 ? bits : 1ULL);
}

/// After the grid has waited: whether the sweep was the last.
__device__ inline bool was_last(const SweepBatch& batch, int sweep) {
  const unsigned long long bits =
      *static_cast<volatile unsigned long long*>(&batch.largest[sweep]);
  return bits == 0 || sqrt(__longlong_as_double(static_cast<long long>(bits))) < batch.tolerance ||
         sweep + 1 == batch.most;
}

/// The sums over all blocks, by a fixed tree.
__device__ inline void report(const SweepBatch& batch, int done, SweepStats* shared) {
  for (int sweep = static_cast<int>(blockIdx.x); sweep < done;
       sweep += static_cast<int>(gridDim.x)) {
    SweepStats sum;
    for (unsigned int b = threadIdx.x; b < gridDim.x; b += kBlockSize) {
      sum = sum + batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + b];
    }
    sum = reduce_block(sum, shared, AddStats{});
    if (threadIdx.x == 0) batch.stats[sweep] = sum;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *batch.done = done;
}

/// A ring in shared memory.
struct StagedMean {
  const NodeId* ring;
  int count;
  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Surroundings&, const P& x,
                                               std::size_t node) const {
    return mean_of(x, ring, ring + count, node);
  }
};

/// Rows of one warp's nodes; a warp reads them at one go, so that every byte that
/// comes is used.
inline constexpr int kStagedIds = 32 * 24;

/// One sweep of form A by the whole grid.
template <class Mean, class Real>
__device__ SweepStats jacobi_sweep(const Surroundings& around, const Mean& mean, Real factor,
                                   const Vec3<Real>* before, Vec3<Real>* after, NodeId* staged) {
  const QuietPositions<Real> x{before};
  SweepStats seen;
  const int lane = static_cast<int>(threadIdx.x % kWarp);
  const std::size_t warps = std::size_t{gridDim.x} * (kBlockSize / kWarp);
  std::size_t tile = std::size_t{blockIdx.x} * (kBlockSize / kWarp) + threadIdx.x / kWarp;
  for (; tile * kWarp < around.node_count; tile += warps) {
    const std::size_t node = tile * kWarp + lane;
    const bool mine = node < around.node_count;
    const bool moves = mine && around.fixed[node] == 0;
    Vec3<Real> place{};
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      const std::int64_t begin = mine ? around.rings.offsets[node] : 0;
      const std::int64_t end = mine ? around.rings.offsets[node + 1] : 0;
      const std::int64_t first = __shfl_sync(kAllLanes, begin, 0);
      const int last_lane =
          static_cast<int>(std::min<std::size_t>(kWarp, around.node_count - tile * kWarp)) - 1;
      const auto count = static_cast<int>(__shfl_sync(kAllLanes, end, last_lane) - first);
      if (count <= kStagedIds) {
        for (int i = lane; i < count; i += kWarp) staged[i] = around.rings.entries[first + i];
        __syncwarp();
        if (moves) {
          const StagedMean ring{staged + (begin - first), static_cast<int>(end - begin)};
          place = step_towards(ring, around, x, node, factor);
        }
        __syncwarp();
      } else if (moves) {
        place = step_towards(mean, around, x, node, factor);
      }
    } else {
      if (moves) place = step_towards(mean, around, x, node, factor);
    }
    if (moves) {
      after[node] = place;
      seen = seen + stats_of_move(before[node], place, false);
    }
  }
  return seen;
}

template <class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize)
    jacobi_kernel(Surroundings around, Mean mean, Real factor, Vec3<Real>* current,
                  Vec3<Real>* spare, SweepBatch batch) {
  constexpr bool kStaged = std::is_same_v<Mean, UniformMean>;
  __shared__ alignas(SweepStats) unsigned char bytes[kBlockSize * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  __shared__ NodeId staged[kStaged ? kBlockSize / 32 * kStagedIds : 1];
  NodeId* const own = staged + (kStaged ? threadIdx.x / 32 * kStagedIds : 0);
  const auto grid = cooperative_groups::this_grid();
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    const SweepStats seen = jacobi_sweep(around, mean, factor, current, spare, own);
    publish(batch, sweep, seen, shared);
    grid.sync();
    last = was_last(batch, sweep);
    Vec3<Real>* const swapped = current;
    current = spare;
    spare = swapped;
  }
  report(batch, sweep, shared);
}

/// Threads of one warp that judge one ball.
template <int kSize>
struct WarpTeam {
  static constexpr int size = kSize;
  int rank;
  unsigned int mask;

  __device__ WarpTeam()
      : rank(static_cast<int>(threadIdx.x % size)),
        mask(size == 32 ? 0xffffffffU
                        : ((1U << (size % 32)) - 1) << (threadIdx.x % 32 / size * size)) {}

  [[nodiscard]] __device__ double lowest(double value) const {
    for (int step = size / 2; step > 0; step /= 2) {
      const double other = __shfl_xor_sync(mask, value, step);
      if (other < value) value = other;
    }
    return value;
  }
  [[nodiscard]] __device__ bool all(bool value) const { return __all_sync(mask, value) != 0; }
};

/// `accept_move` by a warp whose threads hold an element each, so that memory is
/// read once for all trials.
template <class P>
__device__ Vec3<typename P::Real> accept_move(const WarpTeam<kWarp>& team,
                                              const Surroundings& around, const P& x,
                                              std::size_t node,
                                              Vec3<typename P::Real> candidate,
                                              Acceptance acceptance, bool& held) {
  using Real = typename P::Real;
  const std::size_t size = around.balls.size(node);
  const ElementShape& shape = *around.elements.runs[0].shape;
  if (size > kWarp || around.elements.run_count > 1 || shape.dimension != 3 ||
      shape.node_count != 4) {
    return accept_move<WarpTeam<kWarp>, P>(team, around, x, node, candidate, acceptance, held);
  }
  const Vec3<Real> before = x[node];
  if (candidate == before) return before;
  const bool mine = static_cast<std::size_t>(team.rank) < size;
  Vec3d corners[4] = {};
  int own = 0;
  if (mine) {
    const ElementId e = around.balls.begin(node)[team.rank];
    const NodeId* const nodes = around.elements.runs[0].nodes + std::size_t{e} * 4;
    NodeId ids[4];
#pragma unroll
    for (int n = 0; n < 4; ++n) ids[n] = nodes[n];
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      corners[n] = vec3_cast<double>(x[static_cast<std::size_t>(ids[n])]);
      if (static_cast<std::size_t>(ids[n]) == node) own = n;
    }
  }
  const auto score_at = [&](Vec3<Real> place) {
    const Vec3d p = vec3_cast<double>(place);
    return tetrahedron_score(own == 0 ? p : corners[0], own == 1 ? p : corners[1],
                             own == 2 ? p : corners[2], own == 3 ? p : corners[3]);
  };
  const double score_before = mine ? score_at(before) : 2.0;
  const double worst = acceptance.smart ? team.lowest(score_before < 2.0 ? score_before : 2.0) : 0.0;
  Real share = 1;
  for (int trial = 0; trial < 4; ++trial) {
    const Vec3<Real> place = trial == 0 ? candidate : before + share * (candidate - before);
    bool right = true;
    if (mine) {
      const double score = score_at(place);
      right = !(acceptance.smart && score < worst) &&
              !(acceptance.guard && !(score > 0) && score_before > 0);
    }
    if (team.all(right)) return place;
    held = true;
    share /= 2;
  }
  return before;
}

/// `first[c]` is where colour c begins in `nodes`. A team of kTeam threads moves a
/// node.
template <int kTeam, class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    gauss_seidel_kernel(Surroundings around, Mean mean, Real factor, Acceptance acceptance,
                        const NodeId* nodes, const std::uint32_t* first, int colour_count,
                        Vec3<Real>* positions, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kBlockSize * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const WarpTeam<kTeam> team;
  const QuietPositions<Real> x{positions};
  const std::uint32_t own = (blockIdx.x * kBlockSize + threadIdx.x) / kTeam;
  const std::uint32_t teams = gridDim.x * kBlockSize / kTeam;
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (int c = 0; c < colour_count; ++c) {
      for (std::uint32_t n = first[c] + own; n < first[c + 1]; n += teams) {
        const auto node = static_cast<std::size_t>(nodes[n]);
        bool held = false;
        const Vec3<Real> before = x[node];
        const Vec3<Real> place =
            move_node(team, around, x, node, mean, factor, acceptance, held);
        __syncwarp(team.mask);
        if (team.rank != 0) continue;
        positions[node] = place;
        seen = seen + stats_of_move(before, place, held);
      }
      if (c + 1 < colour_count) grid.sync();
    }
    publish(batch, sweep, seen, shared);
    grid.sync();
    last = was_last(batch, sweep);
  }
  report(batch, sweep, shared);
}

/// Runs batches until the watch says that it is done. `launch(batch)` starts one,
/// `finish(sweeps)` learns how many sweeps it did.
template <class Launch, class Finish>
void run_batches(CudaExecutor& executor, unsigned int blocks, ConvergenceWatch& watch,
                 const Launch& launch, const Finish& finish) {
  using Clock = std::chrono::steady_clock;
  constexpr double kAimSeconds = 0.02;  // between two looks at the caller
  auto largest = executor.allocate<unsigned long long>(kMostInBatch);
  auto partial = executor.allocate<SweepStats>(std::size_t{kMostInBatch} * blocks);
  auto* const stats = executor.lane().mapped<SweepStats>(CudaExecutor::kSweepsOffset);
  int* const done = reinterpret_cast<int*>(stats + kMostInBatch);
  int most = kMostInBatch;
  for (bool ended = false; !ended;) {
    const SweepBatch batch{std::min(most, watch.sweeps_ahead()),
                           watch.tolerance(),
                           largest.data(),
                           partial.data(),
                           stats,
                           done};
    executor.clear(largest.data(), kMostInBatch);
    const Clock::time_point start = Clock::now();
    launch(batch);
    executor.synchronize();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    executor.check();
    finish(*done);
    for (int sweep = 0; sweep < *done; ++sweep) ended |= watch.ended_by(stats[sweep]);
    ended = ended || watch.interrupted();
    most = static_cast<int>(std::clamp(kAimSeconds / seconds * *done, 1.0, double{kMostInBatch}));
  }
}

template <int kTeam, class Real, class Mean>
void run_coloured_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                         const Mean& mean, Real factor, ConvergenceWatch& watch) {
  const Surroundings& around = sweeper.around();
  const Colouring<CudaExecutor>& colouring = sweeper.colouring();
  const std::vector<std::uint32_t> first(colouring.first.begin(), colouring.first.end());
  auto first_on_device = executor.allocate<std::uint32_t>(first.size());
  executor.upload(first.data(), first.size(), first_on_device.data());
  constexpr auto kKernel = &gauss_seidel_kernel<kTeam, Mean, Real>;
  const unsigned int blocks = executor.cooperative_blocks<kKernel>(
      block_count(around.node_count / std::max<std::size_t>(colouring.count(), 1) * kTeam));
  run_batches(
      executor, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(
            blocks, around, mean, factor, sweeper.acceptance(), colouring.nodes.data(),
            first_on_device.data(), static_cast<int>(colouring.count()), sweeper.current(), batch);
      },
      [](int) {});
}

/// The sweeps of one step: without a host in between where the form and the
/// acceptance let nodes be judged on the spot.
template <class Real, class Mean>
void run_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper, const Mean& mean,
                double factor, ConvergenceWatch& watch) {
  const Surroundings& around = sweeper.around();
  const auto f = static_cast<Real>(factor);
  if (sweeper.form() == Form::gauss_seidel) {
    // A thread per element of an ordinary ball.
    return dot(around.reference, around.reference) > 0 || around.references != nullptr ? run_coloured_sweeps<8>(executor, sweeper, mean, f, watch)
                             : run_coloured_sweeps<32>(executor, sweeper, mean, f, watch);
  }
  if (sweeper.form() == Form::jacobi && !sweeper.acceptance().active()) {
    constexpr auto kKernel = &jacobi_kernel<Mean, Real>;
    const unsigned int blocks =
        executor.cooperative_blocks<kKernel>(block_count(around.node_count));
    run_batches(
        executor, blocks, watch,
        [&](const SweepBatch& batch) {
          executor.launch_cooperative<kKernel>(blocks, around, mean, f, sweeper.current(),
                                               sweeper.spare(), batch);
        },
        [&](int sweeps) {
          if (sweeps % 2 != 0) sweeper.swap();
        });
    return;
  }
  run_sweeps_one_by_one(sweeper, mean, factor, watch);
}

}  // namespace meshsmooth::detail
