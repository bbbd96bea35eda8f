#pragma once

#include <cooperative_groups.h>

#include <chrono>
#include <utility>

#include "smooth/cuda/cuda_executor.cuh"
#include "smooth/iterate.hpp"

namespace meshsmooth::detail {

/// Sweeps done at one go by a kernel whose blocks wait for each other.
struct SweepBatch {
  int most;                     // sweeps
  double tolerance;             // ends when the largest move is below
  unsigned long long* largest;  // a word per sweep, 0 before: bits of the squared move
  SweepStats* partial;          // [sweep][block]
  SweepStats* stats;            // [sweep], host memory
  int* done;                    // sweeps done, host memory
};

inline constexpr int kMostInBatch = 64;

/// Tells the other blocks the largest move of this one; all threads call.
__device__ inline void publish_largest(const SweepBatch& batch, int sweep, const SweepStats& seen) {
  __shared__ unsigned long long largest;
  // A move whose square is 0 is still a move.
  const auto bits = static_cast<unsigned long long>(__double_as_longlong(seen.max_squared));
  unsigned long long own = seen.moved == 0 ? 0 : bits > 0 ? bits : 1;
  for (int step = kWarp / 2; step > 0; step /= 2) {
    const unsigned long long other = __shfl_xor_sync(kAllLanes, own, step);
    own = other > own ? other : own;
  }
  if (threadIdx.x == 0) largest = 0;
  __syncthreads();
  if (threadIdx.x % kWarp == 0 && own > 0) atomicMax(&largest, own);
  __syncthreads();
  if (threadIdx.x == 0 && largest > 0) atomicMax(&batch.largest[sweep], largest);
}

/// The sum over a block, for thread 0, by a fixed tree; `shared` holds kWarpsPerBlock
/// values.
__device__ inline SweepStats sum_of_block(SweepStats own, SweepStats* shared) {
  const auto fold = [](SweepStats& sum) {
    for (int step = kWarp / 2; step > 0; step /= 2) {
      sum = sum + SweepStats{__shfl_down_sync(kAllLanes, sum.max_squared, step),
                             __shfl_down_sync(kAllLanes, sum.sum_squared, step),
                             __shfl_down_sync(kAllLanes, sum.moved, step),
                             __shfl_down_sync(kAllLanes, sum.held, step)};
    }
  };
  fold(own);
  if (threadIdx.x % kWarp == 0) shared[threadIdx.x / kWarp] = own;
  __syncthreads();
  SweepStats sum;
  if (threadIdx.x < kWarp) {
    if (threadIdx.x < kWarpsPerBlock) sum = shared[threadIdx.x];
    fold(sum);
  }
  __syncthreads();
  return sum;
}

/// Keeps the sum over a block until `report`.
__device__ inline void keep_partial(const SweepBatch& batch, int sweep, const SweepStats& seen,
                                    SweepStats* shared) {
  const SweepStats sum = sum_of_block(seen, shared);
  if (threadIdx.x == 0) {
    batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + blockIdx.x] = sum;
  }
}

/// After the grid has waited: whether the sweep was the last.
__device__ inline bool was_last(const SweepBatch& batch, int sweep) {
  const unsigned long long bits = *static_cast<volatile unsigned long long*>(&batch.largest[sweep]);
  return bits == 0 || sqrt(__longlong_as_double(static_cast<long long>(bits))) < batch.tolerance ||
         sweep + 1 == batch.most;
}

/// Ends a sweep: true when it was the last. The blocks sum up while they wait.
template <class Grid>
__device__ bool end_sweep(const Grid& grid, const SweepBatch& batch, int sweep,
                          const SweepStats& seen, SweepStats* shared) {
  publish_largest(batch, sweep, seen);
  auto arrival = grid.barrier_arrive();
  keep_partial(batch, sweep, seen, shared);
  grid.barrier_wait(std::move(arrival));
  return was_last(batch, sweep);
}

/// The sums over all blocks, by a fixed tree.
template <class Grid>
__device__ void report(const Grid& grid, const SweepBatch& batch, int done, SweepStats* shared) {
  grid.sync();
  for (int sweep = static_cast<int>(blockIdx.x); sweep < done;
       sweep += static_cast<int>(gridDim.x)) {
    SweepStats sum;
    for (unsigned int b = threadIdx.x; b < gridDim.x; b += kBlockSize) {
      sum = sum + batch.partial[static_cast<std::size_t>(sweep) * gridDim.x + b];
    }
    sum = sum_of_block(sum, shared);
    if (threadIdx.x == 0) batch.stats[sweep] = sum;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *batch.done = done;
}

/// Positions, coordinate by coordinate: 32 nodes in a row fill a line of each, so
/// that the neighbours of 32 nodes lie in the fewest lines.
template <class R>
struct PositionPlanes {
  using Real = R;
  R *x, *y, *z;

  PositionPlanes(R* data, std::size_t node_count)
      : x(data), y(data + node_count), z(data + 2 * node_count) {}

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    return {x[node], y[node], z[node]};
  }
  __device__ void store(std::size_t node, Vec3<R> place) const {
    x[node] = place.x;
    y[node] = place.y;
    z[node] = place.z;
  }
};

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

/// The nodes of a warp: 32 in a row, whose rings lie in one stretch of memory. The
/// warp reads them at one go, so that every byte that comes is used.
struct Tile {
  static constexpr int kCapacity = 32 * 18;

  std::size_t node;  // of this thread
  bool moves;
  bool staged;  // the rings of all fit
  StagedMean ring;

  /// All lanes call; `space` holds kCapacity ids of this warp.
  __device__ void load(const Surroundings& around, std::size_t tile, NodeId* space) {
    const auto lane = static_cast<int>(threadIdx.x % kWarp);
    node = tile * kWarp + lane;
    const bool mine = node < around.node_count;
    moves = mine && around.fixed[node] == 0;
    const std::size_t at = mine ? node : around.node_count;
    const std::int64_t begin = around.rings.offsets[at];
    const std::int64_t end = around.rings.offsets[mine ? node + 1 : around.node_count];
    const std::int64_t first = __shfl_sync(kAllLanes, begin, 0);
    const std::int64_t count = __shfl_sync(kAllLanes, end, kWarp - 1) - first;
    staged = count <= kCapacity;
    ring = {space + (begin - first), static_cast<int>(end - begin)};
    if (!staged) return;
    __syncwarp();
    for (int i = lane; i < static_cast<int>(count); i += kWarp) {
      space[i] = around.rings.entries[first + i];
    }
    __syncwarp();
  }
};

/// Form A. Where every warp has but one tile, its rings stay in shared memory from
/// sweep to sweep. More blocks to a multiprocessor would leave each thread fewer
/// registers, and so fewer loads on their way: measured slower.
template <class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 4)
    jacobi_kernel(Surroundings around, Mean mean, Real factor, PositionPlanes<Real> current,
                  PositionPlanes<Real> spare, SweepBatch batch) {
  constexpr bool kUniform = std::is_same_v<Mean, UniformMean>;
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  extern __shared__ NodeId staged[];  // Tile::kCapacity ids a warp
  const auto grid = cooperative_groups::this_grid();
  const unsigned int warp = threadIdx.x / kWarp;
  NodeId* const space = staged + (kUniform ? warp * Tile::kCapacity : 0);
  const std::size_t tiles = (around.node_count + kWarp - 1) / kWarp;
  const std::size_t warps = std::size_t{gridDim.x} * kWarpsPerBlock;
  const std::size_t first = std::size_t{blockIdx.x} * kWarpsPerBlock + warp;
  Tile own;
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (std::size_t tile = first; tile < tiles; tile += warps) {
      if constexpr (kUniform) {
        if (sweep == 0 || tiles > warps) own.load(around, tile, space);
      } else {
        own.node = tile * kWarp + threadIdx.x % kWarp;
        own.moves = own.node < around.node_count && around.fixed[own.node] == 0;
        own.staged = false;
      }
      if (!own.moves) continue;
      const Vec3<Real> before = current[own.node];
      const Vec3<Real> place = own.staged
                                   ? step_towards(own.ring, around, current, own.node, factor)
                                   : step_towards(mean, around, current, own.node, factor);
      spare.store(own.node, place);
      seen = seen + stats_of_move(before, place, false);
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
    const PositionPlanes<Real> swapped = current;
    current = spare;
    spare = swapped;
  }
  report(grid, batch, sweep, shared);
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

/// `UniformMean` by a warp: each thread fetches a neighbour, the sum runs in the
/// row's order.
struct WarpMean {
  WarpTeam<kWarp> team;

  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                               std::size_t node) const {
    using Real = typename P::Real;
    const auto size = static_cast<int>(around.rings.size(node));
    if (size == 0 || size > kWarp) return UniformMean{}(around, x, node);
    const int at = std::min(team.rank, size - 1);
    const Vec3<Real> own = x[static_cast<std::size_t>(around.rings.begin(node)[at])];
    Vec3<Real> sum{0, 0, 0};
#pragma unroll 8
    for (int k = 0; k < size; ++k) {
      sum += Vec3<Real>{__shfl_sync(team.mask, own.x, k), __shfl_sync(team.mask, own.y, k),
                        __shfl_sync(team.mask, own.z, k)};
    }
    const auto count = static_cast<Real>(size);
    return {sum.x / count, sum.y / count, sum.z / count};
  }
};

/// A tetrahedron of a ball, for one thread.
template <class Real>
struct HeldTetrahedron {
  Vec3<Real> corners[4];
  int own;  // the corner that moves

  template <class P>
  __device__ void load(const Elements& elements, const P& x, ElementId e, std::size_t node) {
    NodeId ids[4];
    load_group(elements.runs[0].nodes + std::size_t{e} * 4, ids);
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      corners[n] = x[static_cast<std::size_t>(ids[n])];
      if (static_cast<std::size_t>(ids[n]) == node) own = n;
    }
  }
  [[nodiscard]] __device__ double score(Vec3<Real> place) const {
    Vec3d p[4];
#pragma unroll
    for (int n = 0; n < 4; ++n) p[n] = vec3_cast<double>(n == own ? place : corners[n]);
    return tetrahedron_score(p[0], p[1], p[2], p[3]);
  }
};

/// `accept_move` by a warp whose threads hold one or two elements each, so that
/// memory is read once for all trials.
template <class P>
__device__ Vec3<typename P::Real> accept_move(const WarpTeam<kWarp>& team,
                                              const Surroundings& around, const P& x,
                                              std::size_t node, Vec3<typename P::Real> candidate,
                                              Acceptance acceptance, bool& held) {
  using Real = typename P::Real;
  constexpr int kEach = 2;
  const auto size = static_cast<int>(around.balls.size(node));
  const ElementShape& shape = *around.elements.runs[0].shape;
  if (size > kEach * kWarp || around.elements.run_count > 1 || shape.dimension != 3 ||
      shape.node_count != 4) {
    return accept_move<WarpTeam<kWarp>, P>(team, around, x, node, candidate, acceptance, held);
  }
  const Vec3<Real> before = x[node];
  if (candidate == before) return before;
  HeldTetrahedron<Real> elements[kEach];
  double score_before[kEach];
  double worst = 2.0;
#pragma unroll
  for (int n = 0; n < kEach; ++n) {
    const int at = team.rank + n * kWarp;
    score_before[n] = 0;
    if (at >= size) continue;
    elements[n].load(around.elements, x, around.balls.begin(node)[at], node);
    score_before[n] = elements[n].score(before);
    if (score_before[n] < worst) worst = score_before[n];
  }
  if (acceptance.smart) worst = team.lowest(worst);
  Real share = 1;
  for (int trial = 0; trial < 4; ++trial) {
    const Vec3<Real> place = trial == 0 ? candidate : before + share * (candidate - before);
    bool right = true;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      if (team.rank + n * kWarp >= size) continue;
      const double score = elements[n].score(place);
      right &= !(acceptance.smart && score < worst) &&
               !(acceptance.guard && !(score > 0) && score_before[n] > 0);
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
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
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
        Vec3<Real> place;
        if constexpr (kTeam == kWarp && std::is_same_v<Mean, UniformMean>) {
          place = move_node(team, around, x, node, WarpMean{team}, factor, acceptance, held);
        } else {
          place = move_node(team, around, x, node, mean, factor, acceptance, held);
        }
        __syncwarp(team.mask);
        if (team.rank != 0) continue;
        positions[node] = place;
        seen = seen + stats_of_move(before, place, held);
      }
      if (c + 1 < colour_count) grid.sync();
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
  }
  report(grid, batch, sweep, shared);
}

/// Runs batches until the watch says that it is done. `launch(batch)` starts one,
/// `finish(sweeps)` learns how many sweeps it did.
template <class Launch, class Finish>
void run_batches(CudaExecutor& executor, std::size_t node_count, unsigned int blocks,
                 ConvergenceWatch& watch, const Launch& launch, const Finish& finish) {
  using Clock = std::chrono::steady_clock;
  constexpr double kAimSeconds = 0.02;  // between two looks at the caller
  auto largest = executor.allocate<unsigned long long>(kMostInBatch);
  auto partial = executor.allocate<SweepStats>(std::size_t{kMostInBatch} * blocks);
  auto* const stats = executor.lane().mapped<SweepStats>(CudaExecutor::kSweepsOffset);
  int* const done = reinterpret_cast<int*>(stats + kMostInBatch);
  // What a sweep costs is not known yet: small meshes are done at one go.
  int most = static_cast<int>(
      std::clamp<std::size_t>((std::size_t{1} << 23) / node_count, 1, kMostInBatch));
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

template <class Real>
void to_planes(CudaExecutor& executor, std::size_t node_count, const Vec3<Real>* from,
               PositionPlanes<Real> to, PositionPlanes<Real> also_to) {
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    to.store(node, from[node]);
    also_to.store(node, from[node]);
  });
}
template <class Real>
void from_planes(CudaExecutor& executor, std::size_t node_count, PositionPlanes<Real> from,
                 Vec3<Real>* to) {
  executor.for_each(node_count, [=] __device__(std::size_t node) { to[node] = from[node]; });
}

template <class Real, class Mean>
void run_jacobi_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                       const Mean& mean, Real factor, ConvergenceWatch& watch) {
  const Surroundings& around = sweeper.around();
  auto current_buffer = executor.allocate<Real>(3 * around.node_count);
  auto spare_buffer = executor.allocate<Real>(3 * around.node_count);
  PositionPlanes<Real> current(current_buffer.data(), around.node_count);
  PositionPlanes<Real> spare(spare_buffer.data(), around.node_count);
  to_planes(executor, around.node_count, sweeper.current(), current, spare);
  constexpr auto kKernel = &jacobi_kernel<Mean, Real>;
  const std::size_t shared_bytes =
      std::is_same_v<Mean, UniformMean> ? kWarpsPerBlock * Tile::kCapacity * sizeof(NodeId) : 0;
  const unsigned int blocks =
      executor.cooperative_blocks<kKernel>(block_count(around.node_count), shared_bytes);
  run_batches(
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(blocks, shared_bytes, around, mean, factor, current,
                                             spare, batch);
      },
      [&](int sweeps) {
        if (sweeps % 2 != 0) std::swap(current, spare);
      });
  from_planes(executor, around.node_count, current, sweeper.current());
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
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(
            blocks, std::size_t{0}, around, mean, factor, sweeper.acceptance(),
            colouring.nodes.data(), first_on_device.data(), static_cast<int>(colouring.count()),
            sweeper.current(), batch);
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
  // These kernels know no leash.
  if (sweeper.leashed()) return run_sweeps_one_by_one(sweeper, mean, factor, watch);
  if (sweeper.form() == Form::gauss_seidel) {
    // A thread per element of an ordinary ball.
    return dot(around.reference, around.reference) > 0 || around.references != nullptr
               ? run_coloured_sweeps<8>(executor, sweeper, mean, f, watch)
               : run_coloured_sweeps<32>(executor, sweeper, mean, f, watch);
  }
  if (sweeper.form() == Form::jacobi && !sweeper.acceptance().active()) {
    return run_jacobi_sweeps(executor, sweeper, mean, f, watch);
  }
  run_sweeps_one_by_one(sweeper, mean, factor, watch);
}

}  // namespace meshsmooth::detail
