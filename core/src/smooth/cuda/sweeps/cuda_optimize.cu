#include "smooth/cuda/sweeps/cuda_optimize.hpp"

#include <cooperative_groups.h>

#include <vector>

#include "smooth/cuda/primitives/warp_team.cuh"
#include "smooth/cuda/sweeps/ball_records.cuh"
#include "smooth/cuda/sweeps/batch_pace.hpp"
#include "smooth/cuda/sweeps/team_terms.cuh"

namespace meshsmooth::detail {
namespace {

constexpr int kThreads = 128;    // of a block
constexpr int kMostSweeps = 50;  // of a batch

/// Sweeps done at one go.
struct OptimizeBatch {
  int most;
  PhaseEnd end;
  OptimizeStats* partial;  // [block]
  OptimizeStats* stats;    // [sweep], host memory
  int* done;               // sweeps, host memory
};

/// Of all blocks, in every block, by a fixed tree.
template <class Grid>
__device__ OptimizeStats sum_over_grid(const Grid& grid, const OptimizeStats& own,
                                       OptimizeStats* partial, OptimizeStats* shared) {
  const OptimizeStats sum = reduce_block<kThreads>(own, shared, AddOptimizeStats{});
  if (threadIdx.x == 0) partial[blockIdx.x] = sum;
  grid.sync();
  OptimizeStats all;
  for (unsigned int b = threadIdx.x; b < gridDim.x; b += kThreads) all = all + partial[b];
  return reduce_block<kThreads>(all, shared, AddOptimizeStats{});
}

/// Marks what is around a node as awake; all threads of the team call.
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

__global__ void __launch_bounds__(kBlockSize)
    opposite_kernel(Surroundings around, NodeId* opposite) {
  constexpr unsigned int kTeam = 8;
  const std::size_t node = (std::size_t{blockIdx.x} * kBlockSize + threadIdx.x) / kTeam;
  if (node >= around.node_count) return;
  const std::int64_t end = around.balls.offsets[node + 1];
  for (std::int64_t e = around.balls.offsets[node] + threadIdx.x % kTeam; e < end; e += kTeam) {
    NodeId ids[4];
    load_group(around.elements.runs[0].nodes + std::size_t{around.balls.entries[e]} * 4, ids);
    int own = 0;
#pragma unroll
    for (int n = 1; n < 4; ++n) own = static_cast<std::size_t>(ids[n]) == node ? n : own;
#pragma unroll
    for (int m = 0; m < 3; ++m) {
      const int other = around.elements.runs[0].shape->corners[own].neighbours[m];
      NodeId id = ids[0];
#pragma unroll
      for (int n = 1; n < 4; ++n) id = other == n ? ids[n] : id;
      opposite[3 * e + m] = id;
    }
  }
}

/// What balls consist of.
enum class Balls { surface, volume, tetrahedra };

/// `kBound`: nodes may be on a displacement_limit, or slide.
template <Balls kBalls, bool kBound, int kTeam, class Real>
__global__ void __launch_bounds__(kThreads, 4)
    optimize_kernel(Surroundings around, OptimizePhase phase,
                    DisplacementLimit<Real> displacement_limit, const BallRecord* records,
                    const std::uint32_t* first, int colour_count, std::uint8_t* states,
                    PaddedPositions<Real> x, OptimizeBatch batch) {
  using Team = WarpTeam<kTeam>;
  constexpr int kDimension = kBalls == Balls::surface ? 2 : 3;
  constexpr int kHeld = kTeam == 8 ? 5 : kTeam == 16 ? 3 : 2;
  using Terms = TeamTerms<kHeld, kThreads, Team, Real>;
  constexpr std::size_t kSums = kThreads * sizeof(OptimizeStats);
  constexpr std::size_t kBytes =
      kBalls == Balls::tetrahedra ? std::max(sizeof(typename Terms::Memory), kSums) : kSums;
  __shared__ alignas(16) unsigned char bytes[kBytes];
  auto& memory = *reinterpret_cast<typename Terms::Memory*>(bytes);
  auto* const sums = reinterpret_cast<OptimizeStats*>(bytes);
  const auto grid = cooperative_groups::this_grid();
  const Team team;
  const std::uint32_t own = (blockIdx.x * kThreads + threadIdx.x) / kTeam;
  const std::uint32_t teams = gridDim.x * kThreads / kTeam;

  const auto visit = [&](const BallRecord& ball, const Others& others) -> OptimizeStats {
    const auto node = static_cast<std::size_t>(ball.node);
    if (states != nullptr) {
      const std::uint8_t state = states[node];
      if ((state & kAwake) == 0) {
        return {
            {0, 0, 0, (state & kHeldNode) != 0 ? 1 : 0}, 0, (state & kTangledBall) != 0 ? 1 : 0};
      }
    }
    const Vec3<Real> before = x[node];
    Visit<Real> visit;
    if constexpr (kBalls == Balls::tetrahedra) {
      Terms terms(team, around.opposite, x, ball, others, memory);
      visit = NodeOptimizer<3, kBound, Team, Terms>(team, around, terms, node, Vec3d{0, 0, 0},
                                                    phase, displacement_limit)
                  .visit();
    } else {
      visit = optimize_node<kDimension, 1>(team, around, x, node, phase, displacement_limit);
    }
    const bool moved = !(visit.place == before);
    __syncwarp(team.mask);
    if (team.rank == 0) {
      if (moved) x.store(node, visit.place);
      if (states != nullptr) {
        states[node] =
            static_cast<std::uint8_t>((moved ? kAwake : 0) | (visit.tangled ? kTangledBall : 0) |
                                      (visit.held ? kHeldNode : 0));
      }
    }
    if (states != nullptr && moved) wake_around(team, around, node, states);
    return {stats_of_move(before, visit.place, visit.held), visit.gain, visit.tangled ? 1 : 0};
  };

  // What the next visit needs and what no sweep changes is fetched before the grid waits.
  const std::uint32_t last_record = first[colour_count] - 1;
  BallRecord ahead;
  Others others{};
  const auto fetch = [&](std::uint32_t n) { ahead = records[n < last_record ? n : last_record]; };
  const auto fetch_others = [&] {
    if constexpr (kBalls == Balls::tetrahedra) {
      others = Terms::others(team, around.opposite, ahead, 0);
    }
  };
  std::uint32_t n = own;
  std::uint32_t end = first[1];
  fetch(n);
  fetch_others();
  // Out of the registers: they are what limits the warps at work.
  __shared__ alignas(
      OptimizeStats) unsigned char seen_bytes[kThreads / kTeam * sizeof(OptimizeStats)];
  OptimizeStats& seen = reinterpret_cast<OptimizeStats*>(seen_bytes)[threadIdx.x / kTeam];
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    if (team.rank == 0) seen = {};
    for (int c = 0; c < colour_count; ++c) {
      const int next_colour = c + 1 < colour_count ? c + 1 : 0;
      const std::uint32_t next_begin = first[next_colour];
      const std::uint32_t next_end = first[next_colour + 1];
      if (n >= end) {
        fetch(next_begin + own);
        fetch_others();
      }
      while (n < end) {
        const BallRecord ball = ahead;
        n += teams;
        fetch(n < end ? n : next_begin + own);
        const OptimizeStats did = visit(ball, others);
        if (team.rank == 0) seen = seen + did;
        fetch_others();
      }
      n = next_begin + own;
      end = next_end;
      if (c + 1 < colour_count) grid.sync();
    }
    __syncthreads();  // the sums lie where the terms were
    const OptimizeStats stats = sum_over_grid(grid, team.rank == 0 ? seen : OptimizeStats{},
                                              batch.partial + (sweep % 2) * gridDim.x, sums);
    if (blockIdx.x == 0 && threadIdx.x == 0) batch.stats[sweep] = stats;
    last = batch.end.after(stats) || sweep + 1 == batch.most;
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *batch.done = sweep;
}

template <Balls kBalls, bool kBound, int kTeam, class Real>
void run_with(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
              const OptimizePhase& phase, PhaseMonitor& watch) {
  constexpr auto kKernel = &optimize_kernel<kBalls, kBound, kTeam, Real>;
  const Surroundings& around = sweeper.around();
  const BallRecords balls = record_balls(executor, around, sweeper.colouring());
  auto padded = executor.allocate<Real>(PaddedPositions<Real>::size(around.node_count));
  const PaddedPositions<Real> x(padded.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.positions(), x);

  const unsigned int blocks = executor.cooperative_blocks<kKernel>(
      (balls.largest * kTeam + kThreads - 1) / kThreads, kThreads);
  auto partial = executor.allocate<OptimizeStats>(2 * std::size_t{blocks});
  auto* const stats = executor.lane().mapped<OptimizeStats>(CudaExecutor::kSweepsOffset);
  int* const done = reinterpret_cast<int*>(stats + kMostSweeps);
  // Where few balls are visited, whether they changed is energy knowing.
  std::uint8_t* const states = phase.poor > 0 ? sweeper.states() : nullptr;

  BatchPace pace(around.node_count, kMostSweeps);
  for (bool ended = false; !ended;) {
    const OptimizeBatch batch{pace.next(watch.sweeps_ahead()), watch.end(), partial.data(), stats,
                              done};
    pace.start();
    executor.launch_cooperative<kKernel>(blocks, kThreads, 0, around, phase,
                                         sweeper.displacement_limit(), balls.records.data(),
                                         balls.first.data(), balls.colour_count, states, x, batch);
    if (watch.needs_energy()) {
      unpad_positions(executor, around.node_count, x, sweeper.positions());
      const MeshEnergy energy = sweeper.measure(phase.power);
      ended = watch.ended_by(stats[0], &energy);
    } else {
      executor.synchronize();
      executor.check();
      for (int sweep = 0; sweep < *done; ++sweep) ended |= watch.ended_by(stats[sweep], nullptr);
    }
    pace.stop(*done);
    ended = ended || watch.interrupted();
  }
  unpad_positions(executor, around.node_count, x, sweeper.positions());
}

}  // namespace

DeviceBuffer<NodeId> find_opposite_nodes(CudaExecutor& executor, const Surroundings& around) {
  auto opposite = executor.allocate<NodeId>(3 * 4 * around.elements.count);
  executor.launch<&opposite_kernel>(block_count(around.node_count * 8, 1U << 30), around,
                                    opposite.data());
  return opposite;
}

template <class Real>
void run_phase(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
               const OptimizePhase& phase, PhaseMonitor& watch) {
  const Surroundings& around = sweeper.around();
  const bool bound = sweeper.displacement_limit().home != nullptr || around.sliding.any();
  const std::size_t n = around.node_count;
  if (sweeper.surface()) return run_with<Balls::surface, true, 8>(executor, sweeper, phase, watch);
  if (around.opposite == nullptr) {
    return run_with<Balls::volume, true, 8>(executor, sweeper, phase, watch);
  }
  if (bound) return run_with<Balls::tetrahedra, true, 8>(executor, sweeper, phase, watch);
  if (n < 30000) return run_with<Balls::tetrahedra, false, 32>(executor, sweeper, phase, watch);
  if (n < 300000) return run_with<Balls::tetrahedra, false, 16>(executor, sweeper, phase, watch);
  run_with<Balls::tetrahedra, false, 8>(executor, sweeper, phase, watch);
}

template void run_phase(CudaExecutor&, OptimizeSweeper<CudaExecutor, float>&, const OptimizePhase&,
                        PhaseMonitor&);
template void run_phase(CudaExecutor&, OptimizeSweeper<CudaExecutor, double>&, const OptimizePhase&,
                        PhaseMonitor&);

}  // namespace meshsmooth::detail
