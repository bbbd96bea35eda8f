#pragma once

#include "smooth/base/colouring_rule.hpp"
#include "smooth/cuda/primitives/warp_team.cuh"
#include "smooth/cuda/sweeps/coloured_loop.cuh"
#include "smooth/cuda/sweeps/team_terms.cuh"
#include "smooth/optimize/optimize_visit.hpp"

namespace meshsmooth::detail {

inline constexpr unsigned int kOptimizeThreads = 128;

/// Sweeps done by one launch.
struct OptimizeBatch {
  int most;
  PhaseEnd end;
  double gain_before;      // the gain of the sweep before the batch
  OptimizeStats* partial;  // [sweep's parity][block]
  OptimizeStats* stats;    // [sweep], host memory
  int* done;               // sweeps, host memory
};

/// The sum over all blocks, in every block, by a fixed tree.
template <class Grid>
__device__ OptimizeStats sum_over_grid(const Grid& grid, const OptimizeStats& own,
                                       OptimizeStats* partial, OptimizeStats* shared) {
  const OptimizeStats sum = reduce_block<kOptimizeThreads>(own, shared, Plus{});
  if (threadIdx.x == 0) partial[blockIdx.x] = sum;
  grid.sync();
  OptimizeStats all;
  for (unsigned int b = threadIdx.x; b < gridDim.x; b += kOptimizeThreads) all = all + partial[b];
  return reduce_block<kOptimizeThreads>(all, shared, Plus{});
}

/// Marks the nodes around a node as awake; all threads of the team call.
template <class Team>
__device__ void wake_around(const Team& team, const Surroundings& around, std::size_t node,
                            std::uint8_t* states) {
  if (around.elements.simplices()) {
    for (const NodeId* n = around.rings.begin(node) + team.rank; n < around.rings.end(node);
         n += Team::size) {
      CudaExecutor::store(states[*n], std::uint8_t{kAwake});
    }
  } else if (team.rank == 0) {
    visit_adjacent(around, node, [&](NodeId other) {
      if (static_cast<std::size_t>(other) != node) {
        CudaExecutor::store(states[other], std::uint8_t{kAwake});
      }
      return true;
    });
  }
}

/// What balls consist of.
enum class Balls { surface, volume, tetrahedra, reference_tetrahedra };
[[nodiscard]] constexpr bool of_tetrahedra(Balls balls) {
  return balls == Balls::tetrahedra || balls == Balls::reference_tetrahedra;
}

/// What a visit must know before it can ask for positions.
template <Balls kBalls, class Terms, class Team>
struct OptimizeVisit {
  const Team& team;
  const NodeId* opposite;
  BallRecord ball;
  Others others;

  __device__ void fetch() {
    if constexpr (of_tetrahedra(kBalls)) others = Terms::others(team, opposite, ball, 0);
  }
};

/// One phase of the optimizer: a team of kTeam threads moves a node by a Newton step.
/// kBound: nodes may have a displacement limit, slide, or be held by anchors.
/// grid   cooperative: blocks of kOptimizeThreads that are all resident, four per multiprocessor
/// shared terms of the teams' balls or one sum per thread (aliased), and a sum per team
/// needs  balls and rings, nodes by colour, opposite nodes of tetrahedra
/// order  deterministic: the nodes of a colour are independent, sums by a fixed tree
/// fast   no launch and no host between sweeps; 156 us a sweep at 100k, 900 at 1M (H200). At 100k
///        half of it is waiting for colours, at 1M the latency of the arithmetic at four warps a
///        scheduler. Tried in vain: five blocks (spills), two terms at once.
/// equals `sweep_optimize` of the CPU backend up to rounding: multiply-adds are fused here
template <Balls kBalls, bool kBound, int kTeam, class Real>
__global__ void __launch_bounds__(kOptimizeThreads, 4)
    optimize_kernel(Surroundings around, OptimizePhase phase,
                    DisplacementLimit<Real> displacement_limit, ColouredNodes nodes,
                    std::uint8_t* states, PaddedPositions<Real> x, TetrahedronTargets<Real> targets,
                    OptimizeBatch batch) {
  using Team = WarpTeam<kTeam>;
  constexpr int kDimension = kBalls == Balls::surface ? 2 : 3;
  constexpr int kHeld = kTeam == 8 ? 5 : kTeam == 16 ? 3 : 2;
  using Terms =
      TeamTerms<kHeld, kOptimizeThreads, kBalls == Balls::reference_tetrahedra, Team, Real>;
  using Ahead = OptimizeVisit<kBalls, Terms, Team>;
  constexpr std::size_t kSums = kOptimizeThreads * sizeof(OptimizeStats);
  constexpr std::size_t kBytes =
      of_tetrahedra(kBalls) ? std::max(sizeof(typename Terms::Memory), kSums) : kSums;
  __shared__ alignas(16) unsigned char bytes[kBytes];
  auto& memory = *reinterpret_cast<typename Terms::Memory*>(bytes);
  auto* const sums = reinterpret_cast<OptimizeStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const Team team;

  const auto visit = [&](const Ahead& now) -> OptimizeStats {
    const auto node = static_cast<std::size_t>(now.ball.node);
    if (states != nullptr) {
      const std::uint8_t state = states[node];
      if ((state & kAwake) == 0) return stats_asleep(state);
    }
    const Vec3<Real> before = x[node];
    Visit<Real> visit;
    if constexpr (of_tetrahedra(kBalls)) {
      Terms terms(team, around.opposite, x, targets, now.ball, now.others, memory);
      visit = NodeOptimizer<3, kBound, Team, Terms>(team, around, terms, node, Vec3d{0, 0, 0},
                                                    phase, displacement_limit)
                  .visit();
    } else {
      visit = optimize_node<kDimension, 1>(team, around, x, node, phase, displacement_limit);
    }
    const bool moved = !(visit.position == before);
    __syncwarp(team.mask);
    if (team.rank == 0) {
      if (moved) x.store(node, visit.position);
      if (states != nullptr) states[node] = state_after(before, visit);
    }
    if (states != nullptr && moved) wake_around(team, around, node, states);
    return stats_of_visit(before, visit);
  };

  ColouredLoop<kTeam, kOptimizeThreads, Ahead> loop(nodes, {team, around.opposite});
  // In shared memory: registers limit the number of active warps (with fewer votes, 100k 179 to
  // 160 us a sweep, H200).
  __shared__ alignas(
      OptimizeStats) unsigned char seen_bytes[kOptimizeThreads / kTeam * sizeof(OptimizeStats)];
  OptimizeStats& seen = reinterpret_cast<OptimizeStats*>(seen_bytes)[threadIdx.x / kTeam];
  double gain_before = batch.gain_before;
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    if (team.rank == 0) seen = {};
    loop.sweep(grid, visit, [&](const OptimizeStats& found) {
      if (team.rank == 0) seen = seen + found;
    });
    __syncthreads();  // the sums overwrite the terms
    const OptimizeStats stats = sum_over_grid(grid, team.rank == 0 ? seen : OptimizeStats{},
                                              batch.partial + (sweep % 2) * gridDim.x, sums);
    if (blockIdx.x == 0 && threadIdx.x == 0) batch.stats[sweep] = stats;
    last = batch.end.after(stats, gain_before) || sweep + 1 == batch.most;
    gain_before = stats.gain;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *batch.done = sweep;
}

}  // namespace meshsmooth::detail
