#pragma once

#include "smooth/cuda/sweep_batch.cuh"
#include "smooth/cuda/warp_team.cuh"

namespace meshsmooth::detail {

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

/// The ball of a node, for a warp whose threads hold one or two tetrahedra each, so that
/// memory is read once for all trials.
template <class Real>
class HeldBall {
 public:
  /// Whether the node's ball is one that can be held.
  static __device__ bool fits(const Surroundings& around, std::size_t node) {
    const ElementShape& shape = *around.elements.runs[0].shape;
    return around.balls.size(node) <= kEach * kWarp && around.elements.run_count == 1 &&
           shape.dimension == 3 && shape.node_count == 4;
  }

  template <class P>
  __device__ HeldBall(const WarpTeam<kWarp>& team, const Surroundings& around, const P& x,
                      std::size_t node)
      : team_(team), size_(static_cast<int>(around.balls.size(node))) {
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int at = team.rank + n * kWarp;
      if (at < size_) {
        elements_[n].load(around.elements, x, around.balls.begin(node)[at], node);
      }
    }
  }

  /// `accept_move` from `before`. Two trials at a time: most balls take several, and one
  /// alone would leave the arithmetic waiting for itself.
  __device__ Vec3<Real> accept_move(Vec3<Real> before, Vec3<Real> candidate, Acceptance acceptance,
                                    bool& held) const {
    if (candidate == before) return before;
    double score_before[kEach];
    double worst = 2.0;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      score_before[n] = 0;
      if (team_.rank + n * kWarp >= size_) continue;
      score_before[n] = elements_[n].score(before);
      if (score_before[n] < worst) worst = score_before[n];
    }
    if (acceptance.smart) worst = team_.lowest(worst);
    constexpr int kAtOnce = 2;
    Real share = 1;
    for (int trial = 0; trial < 4; trial += kAtOnce) {
      Vec3<Real> places[kAtOnce];
      bool right[kAtOnce];
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) {
        places[k] = trial + k == 0 ? candidate : before + share * (candidate - before);
        right[k] = true;
        share /= 2;
      }
#pragma unroll
      for (int n = 0; n < kEach; ++n) {
        if (team_.rank + n * kWarp >= size_) continue;
#pragma unroll
        for (int k = 0; k < kAtOnce; ++k) {
          const double score = elements_[n].score(places[k]);
          right[k] &= !(acceptance.smart && score < worst) &&
                      !(acceptance.guard && !(score > 0) && score_before[n] > 0);
        }
      }
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) {
        if (team_.all(right[k])) return places[k];
        held = true;
      }
    }
    return before;
  }

 private:
  static constexpr int kEach = 2;
  const WarpTeam<kWarp>& team_;
  int size_;
  HeldTetrahedron<Real> elements_[kEach];
};

/// `move_node` by a warp: what it has to fetch is on its way at the same time.
template <class P>
__device__ Vec3<typename P::Real> move_node(const WarpTeam<kWarp>& team, const Surroundings& around,
                                            const P& x, std::size_t node, const WarpMean& mean,
                                            typename P::Real factor, Acceptance acceptance,
                                            bool& held) {
  if (!acceptance.active() || !HeldBall<typename P::Real>::fits(around, node)) {
    return move_node<WarpTeam<kWarp>, WarpMean, P>(team, around, x, node, mean, factor, acceptance,
                                                   held);
  }
  const HeldBall<typename P::Real> ball(team, around, x, node);
  const Vec3<typename P::Real> candidate = step_towards(mean, around, x, node, factor);
  return ball.accept_move(x[node], candidate, acceptance, held);
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
  report(grid, batch, sweep);
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
            blocks, kBlockSize, 0, around, mean, factor, sweeper.acceptance(),
            colouring.nodes.data(), first_on_device.data(), static_cast<int>(colouring.count()),
            sweeper.current(), batch);
      },
      [](int) {});
}

}  // namespace meshsmooth::detail
