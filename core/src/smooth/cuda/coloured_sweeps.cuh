#pragma once

#include "smooth/cuda/ball_records.cuh"
#include "smooth/cuda/padded_positions.cuh"
#include "smooth/cuda/sweep_batch.cuh"
#include "smooth/cuda/warp_team.cuh"

namespace meshsmooth::detail {

/// `UniformMean` by a team: each thread fetches two neighbours, the sum runs in the
/// row's order.
template <class Team>
struct TeamMean {
  Team team;

  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                               std::size_t node) const {
    using Real = typename P::Real;
    const auto size = static_cast<int>(around.rings.size(node));
    if (size == 0 || size > 2 * Team::size) return UniformMean{}(around, x, node);
    const NodeId* const ring = around.rings.begin(node);
    const auto fetch = [&](int k) {
      return x[static_cast<std::size_t>(ring[k < size ? k : size - 1])];
    };
    const Vec3<Real> first = fetch(team.rank);
    const Vec3<Real> second = fetch(team.rank + Team::size);
    Vec3<Real> sum{0, 0, 0};
    const auto add = [&](const Vec3<Real>& from, int count) {
#pragma unroll 8
      for (int k = 0; k < count; ++k) {
        sum += Vec3<Real>{__shfl_sync(team.mask, from.x, k, Team::size),
                          __shfl_sync(team.mask, from.y, k, Team::size),
                          __shfl_sync(team.mask, from.z, k, Team::size)};
      }
    };
    add(first, size < Team::size ? size : Team::size);
    add(second, size - Team::size);
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

/// The ball of a node, for a team whose threads hold some tetrahedra each, so that
/// memory is read once for all trials.
template <class Team, class Real>
class HeldBall {
 public:
  /// Whether the node's ball is one that can be held.
  static __device__ bool fits(const Surroundings& around, std::size_t node) {
    const ElementShape& shape = *around.elements.runs[0].shape;
    return around.balls.size(node) <= kEach * Team::size && around.elements.run_count == 1 &&
           shape.dimension == 3 && shape.node_count == 4;
  }

  template <class P>
  __device__ HeldBall(const Team& team, const Surroundings& around, const P& x, std::size_t node)
      : team_(team), size_(static_cast<int>(around.balls.size(node))) {
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int at = team.rank + n * Team::size;
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
      if (team_.rank + n * Team::size >= size_) continue;
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
        if (team_.rank + n * Team::size >= size_) continue;
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
  static constexpr int kEach = 64 / Team::size;
  const Team& team_;
  int size_;
  HeldTetrahedron<Real> elements_[kEach];
};

/// `move_node` by a team: what it has to fetch is on its way at the same time.
template <class Team, class P>
__device__ Vec3<typename P::Real> move_node(const Team& team, const Surroundings& around,
                                            const P& x, std::size_t node,
                                            const TeamMean<Team>& mean, typename P::Real factor,
                                            Acceptance acceptance, bool& held) {
  using Ball = HeldBall<Team, typename P::Real>;
  const Vec3<typename P::Real> before = x[node];
  if (!acceptance.active() || !Ball::fits(around, node)) {
    const Vec3<typename P::Real> place = step_towards(mean, around, x, node, factor);
    return acceptance.active() ? accept_move(team, around, x, node, place, acceptance, held)
                               : place;
  }
  const Ball ball(team, around, x, node);
  const Vec3<typename P::Real> candidate = step_towards(mean, around, x, node, factor);
  return ball.accept_move(before, candidate, acceptance, held);
}

/// A team of kTeam threads moves a node.
template <int kTeam, class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    gauss_seidel_kernel(Surroundings around, Mean mean, Real factor, Acceptance acceptance,
                        const BallRecord* records, const std::uint32_t* first, int colour_count,
                        PaddedPositions<Real> x, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const WarpTeam<kTeam> team;
  // Known here, so that no code is made for facets.
  const Acceptance accepted{acceptance.guard, acceptance.smart, false};
  const std::uint32_t own = (blockIdx.x * kBlockSize + threadIdx.x) / kTeam;
  const std::uint32_t teams = gridDim.x * kBlockSize / kTeam;
  // Which node comes next is fetched before the grid waits.
  const std::uint32_t last_record = first[colour_count] - 1;
  const auto node_at = [&](std::uint32_t n) {
    return static_cast<std::size_t>(records[n < last_record ? n : last_record].node);
  };
  std::uint32_t n = own;
  std::uint32_t end = first[1];
  std::size_t ahead = node_at(n);
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (int c = 0; c < colour_count; ++c) {
      const int next_colour = c + 1 < colour_count ? c + 1 : 0;
      const std::uint32_t next_begin = first[next_colour];
      const std::uint32_t next_end = first[next_colour + 1];
      if (n >= end) ahead = node_at(next_begin + own);
      while (n < end) {
        const std::size_t node = ahead;
        n += teams;
        ahead = node_at(n < end ? n : next_begin + own);
        bool held = false;
        const Vec3<Real> before = x[node];
        Vec3<Real> place;
        if constexpr (std::is_same_v<Mean, UniformMean>) {
          place = move_node(team, around, x, node, TeamMean<WarpTeam<kTeam>>{team}, factor,
                            accepted, held);
        } else {
          place = move_node(team, around, x, node, mean, factor, accepted, held);
        }
        __syncwarp(team.mask);
        if (team.rank != 0) continue;
        x.store(node, place);
        seen = seen + stats_of_move(before, place, held);
      }
      n = next_begin + own;
      end = next_end;
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
  const BallRecords balls = record_balls(executor, around, sweeper.colouring());
  auto padded = executor.allocate<FourOf<Real>>(PaddedPositions<Real>::size(around.node_count));
  const PaddedPositions<Real> x{padded.data()};
  pad_positions(executor, around.node_count, sweeper.current(), x);
  constexpr auto kKernel = &gauss_seidel_kernel<kTeam, Mean, Real>;
  const unsigned int blocks =
      executor.cooperative_blocks<kKernel>(block_count(balls.largest * kTeam));
  run_batches(
      executor, around.node_count, blocks, watch,
      [&](const SweepBatch& batch) {
        executor.launch_cooperative<kKernel>(blocks, kBlockSize, 0, around, mean, factor,
                                             sweeper.acceptance(), balls.records.data(),
                                             balls.first.data(), balls.colour_count, x, batch);
      },
      [](int) {});
  unpad_positions(executor, around.node_count, x, sweeper.current());
}

}  // namespace meshsmooth::detail
