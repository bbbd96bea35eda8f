#pragma once

#include "smooth/cuda/primitives/warp_team.cuh"
#include "smooth/cuda/sweeps/coloured_loop.cuh"
#include "smooth/cuda/sweeps/held_ball.cuh"
#include "smooth/cuda/sweeps/padded_positions.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// `UniformMean` by a team: each thread gathers two neighbours into shared memory, from where all
/// add up the row in its order. A second text because it is faster than shuffles, of which each
/// neighbour takes three (smart Laplacian 5.46 to 5.06 ms for 20 sweeps at 100k, H200), and as a
/// tree would sum with other bits. parity_test compares them with the CPU's.
template <class Team>
struct TeamMean {
  Team team;

  template <class P>
  __device__ Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                               std::size_t node, const NodeId* ring,
                                               int size) const {
    using Real = typename P::Real;
    if (size == 0 || size > 2 * Team::size) return UniformMean{}(around, x, node);
    __shared__ FourOf<Real> positions_of[kBlockSize / Team::size][2 * Team::size];
    FourOf<Real>* const positions = positions_of[threadIdx.x / Team::size];
    const auto fetch = [&](int k) {
      const Vec3<Real> p = x[static_cast<std::size_t>(ring[k < size ? k : size - 1])];
      return FourOf<Real>{p.x, p.y, p.z, 0};
    };
    const FourOf<Real> first = fetch(team.rank);
    const FourOf<Real> second = fetch(team.rank + Team::size);
    positions[team.rank] = first;
    positions[team.rank + Team::size] = second;
    __syncwarp(team.mask);
    Vec3<Real> sum{0, 0, 0};
#pragma unroll 8
    for (int k = 0; k < size; ++k) {
      const FourOf<Real> p = positions[k];
      sum += Vec3<Real>{p.values[0], p.values[1], p.values[2]};
    }
    __syncwarp(team.mask);  // before the next node's positions overwrite them
    const auto count = static_cast<Real>(size);
    return mean_of_sum(sum, count);
  }
};

/// What a visit must know before it can ask for positions.
template <class Team>
struct NodeVisit {
  const Team& team;
  const Surroundings& around;
  BallRecord ball;
  ElementId element;  // the thread's first of the ball
  const NodeId* ring;
  int ring_size;

  __device__ void fetch() {
    element = team.rank < ball.size ? around.balls.entries[ball.begin + team.rank] : 0;
    const std::int64_t begin = around.rings.offsets[ball.node];
    ring = around.rings.entries + begin;
    ring_size = static_cast<int>(around.rings.offsets[ball.node + 1] - begin);
  }
};

/// What a visit found.
template <class Real>
struct NodeMove {
  std::size_t node;
  Vec3<Real> before;
  Vec3<Real> after{};
  bool held = false;
};

/// `move_node` with the mean of the ring, by a team: ball and ring are fetched together.
template <bool kTetrahedra, class Team, class P>
__device__ Vec3<typename P::Real> move_to_mean(const Team& team, const Surroundings& around,
                                               const P& x, const NodeVisit<Team>& visit,
                                               typename P::Real factor, Acceptance acceptance,
                                               bool& held) {
  using Real = typename P::Real;
  using Ball = HeldBall<Team, Real>;
  const auto node = static_cast<std::size_t>(visit.ball.node);
  const Vec3<Real> before = x[node];
  const auto candidate = [&] {
    return step_to(TeamMean<Team>{team}(around, x, node, visit.ring, visit.ring_size), before,
                   factor);
  };
  if (!acceptance.active()) return candidate();
  if (!Ball::fits(around, visit.ball)) {
    return accept_move<kTetrahedra>(team, around, x, node, candidate(), {acceptance}, held);
  }
  const Ball ball(team, around, x, visit.ball, visit.element);
  return ball.accept_move(before, candidate(), acceptance, held);
}

/// Laplacian sweeps in Gauss-Seidel form: a team of kTeam threads moves a node.
/// grid   cooperative: blocks of kBlockSize that are all resident, two per multiprocessor
/// shared the team's positions, and one sum per warp
/// needs  balls and rings, nodes by colour
/// order  deterministic: the nodes of a colour are independent, sums by a fixed tree
/// fast   no launch and no host between sweeps, a grid barrier per colour. 20 smart sweeps at 100k
///        in 4.63 ms (H200); 38 % of a warp's time is the end of colours
/// equals `sweep_gauss_seidel`, bit by bit
template <int kTeam, bool kTetrahedra, class Mean, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    gauss_seidel_kernel(Surroundings around, Mean mean, Real factor, Acceptance acceptance,
                        ColouredNodes nodes, PaddedPositions<Real> x, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  using Team = WarpTeam<kTeam>;
  const Team team;
  // A constant, so that no code for facets is generated.
  const Acceptance accepted{acceptance.guard, acceptance.smart, false};
  const auto visit = [&](const NodeVisit<Team>& now) {
    const auto node = static_cast<std::size_t>(now.ball.node);
    NodeMove<Real> move{node, x[node]};
    if constexpr (std::is_same_v<Mean, UniformMean>) {
      move.after = move_to_mean<kTetrahedra>(team, around, x, now, factor, accepted, move.held);
    } else {
      move.after = move_node(team, around, x, node, LaplacianStep<Mean, Real>{mean, factor},
                             {accepted}, move.held);
    }
    return move;
  };

  ColouredLoop<kTeam, kBlockSize, NodeVisit<Team>> loop(nodes, {team, around});
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    loop.sweep(grid, visit, [&](const NodeMove<Real>& move) {
      __syncwarp(team.mask);
      if (team.rank != 0) return;
      x.store(move.node, move.after);
      seen = seen + stats_of_move(move.before, move.after, move.held);
    });
    last = end_sweep(grid, batch, sweep, seen, shared);
  }
  report(grid, batch, sweep);
}

/// kTetrahedra: there is nothing else.
template <int kTeam, bool kTetrahedra = false, class Real, class Mean>
void run_coloured_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                         const Mean& mean, Real factor, ConvergenceMonitor& monitor) {
  const Surroundings& around = sweeper.around();
  const BallRecords balls = record_balls(executor, around, sweeper.colouring());
  auto padded = executor.allocate<Real>(PaddedPositions<Real>::size(around.node_count));
  const PaddedPositions<Real> x(padded.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.current(), x);
  constexpr auto kKernel = &gauss_seidel_kernel<kTeam, kTetrahedra, Mean, Real>;
  const unsigned int blocks =
      cooperative_blocks<kKernel>(executor.lane(), block_count(balls.largest * kTeam));
  run_sweep_batches(
      executor, around.node_count, blocks, monitor,
      [&](const SweepBatch& batch) {
        launch_cooperative<kKernel>(executor.stream(), {blocks}, around, mean, factor,
                                    sweeper.acceptance(), balls.nodes(), x, batch);
      },
      [](int) {});
  unpad_positions(executor, around.node_count, x, sweeper.current());
}

}  // namespace meshsmooth::detail
