#include "smooth/cuda/sweeps/optimize.hpp"

#include "smooth/cuda/sweeps/batch_loop.cuh"
#include "smooth/cuda/sweeps/optimize_kernel.cuh"

// No anonymous namespace in a file that nvcc compiles: it names one by a hash with the file's path
// in it, and two builds in different folders would differ.
namespace meshsmooth::detail {

/// For every entry of a ball of tetrahedra the three other nodes, in the corner's order.
/// grid   blocks of kBlockSize, a team of 8 threads per node, so that accesses are coalesced
/// order  deterministic
/// equals `find_opposite_nodes` of the CPU backend
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

template <Balls kBalls, bool kBound, int kTeam, class Real>
void run_with(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
              const OptimizePhase& phase, PhaseMonitor& monitor,
              const std::function<MeshEnergy()>& measure) {
  constexpr auto kKernel = &optimize_kernel<kBalls, kBound, kTeam, Real>;
  constexpr int kMostSweeps = 50;  // of a batch
  const Surroundings& around = sweeper.around();
  const BallRecords balls = record_balls(executor, around, sweeper.colouring());
  auto padded = executor.allocate<Real>(PaddedPositions<Real>::size(around.node_count));
  const PaddedPositions<Real> x(padded.data(), around.node_count);
  pad_positions(executor, around.node_count, sweeper.positions(), x);
  const bool has_reference = kBalls == Balls::reference_tetrahedra;
  auto padded_reference =
      executor.allocate<Real>(has_reference ? PaddedPositions<Real>::size(around.node_count) : 0);
  const TetrahedronTargets<Real> targets{{padded_reference.data(), around.node_count},
                                         around.elements.runs[0].shape,
                                         around.targets.some_flat,
                                         around.targets.certainty};
  if (has_reference) {
    pad_positions(executor, around.node_count, around.targets.reference, targets.reference);
  }

  const unsigned int blocks = cooperative_blocks<kKernel>(
      executor.lane(), (balls.largest * kTeam + kOptimizeThreads - 1) / kOptimizeThreads,
      kOptimizeThreads);
  auto partial = executor.allocate<OptimizeStats>(2 * std::size_t{blocks});
  auto* const stats = executor.lane().mapped<OptimizeStats>(CudaLane::kSweepsOffset);
  int& done = *reinterpret_cast<int*>(stats + kMostSweeps);
  // Where few balls are visited, it pays to know whether they have changed.
  std::uint8_t* const states = phase.poor > 0 ? sweeper.states() : nullptr;
  run_batches(
      around.node_count, kMostSweeps, monitor, done,
      [&](int most) {
        launch_cooperative<kKernel>(
            executor.stream(), {blocks, kOptimizeThreads}, around, phase,
            sweeper.displacement_limit(), balls.nodes(), states, x, targets,
            OptimizeBatch{most, monitor.end(), monitor.last().gain, partial.data(), stats, &done});
      },
      [&] {
        if (monitor.needs_energy()) {
          unpad_positions(executor, around.node_count, x, sweeper.positions());
          const MeshEnergy energy = measure();
          return monitor.ended_by(stats[0], &energy);
        }
        executor.synchronize();
        executor.check();
        bool ended = false;
        for (int sweep = 0; sweep < done; ++sweep) ended |= monitor.ended_by(stats[sweep], nullptr);
        return ended;
      });
  unpad_positions(executor, around.node_count, x, sweeper.positions());
}

DeviceBuffer<NodeId> find_opposite_nodes(CudaExecutor& executor, const Surroundings& around) {
  auto opposite = executor.allocate<NodeId>(3 * 4 * around.elements.count);
  launch<&opposite_kernel>(executor.stream(), {block_count(around.node_count * 8, 1U << 30)},
                           around, opposite.data());
  return opposite;
}

template <class Real>
void run_phase(CudaExecutor& executor, OptimizeSweeper<CudaExecutor, Real>& sweeper,
               const OptimizePhase& phase, PhaseMonitor& monitor,
               const std::function<MeshEnergy()>& measure) {
  const Surroundings& around = sweeper.around();
  const bool bound = sweeper.displacement_limit().home != nullptr || around.sliding.any() ||
                     around.anchors != nullptr;
  const std::size_t n = around.node_count;
  if (sweeper.surface()) {
    return run_with<Balls::surface, true, 8>(executor, sweeper, phase, monitor, measure);
  }
  if (around.opposite == nullptr) {
    return run_with<Balls::volume, true, 8>(executor, sweeper, phase, monitor, measure);
  }
  const auto run_on = [&]<Balls kBalls>() {
    if (bound) return run_with<kBalls, true, 8>(executor, sweeper, phase, monitor, measure);
    if (n < 30000) return run_with<kBalls, false, 32>(executor, sweeper, phase, monitor, measure);
    if (n < 300000) return run_with<kBalls, false, 16>(executor, sweeper, phase, monitor, measure);
    run_with<kBalls, false, 8>(executor, sweeper, phase, monitor, measure);
  };
  if (around.targets.reference != nullptr) {
    return run_on.template operator()<Balls::reference_tetrahedra>();
  }
  run_on.template operator()<Balls::tetrahedra>();
}

template void run_phase(CudaExecutor&, OptimizeSweeper<CudaExecutor, float>&, const OptimizePhase&,
                        PhaseMonitor&, const std::function<MeshEnergy()>&);
template void run_phase(CudaExecutor&, OptimizeSweeper<CudaExecutor, double>&, const OptimizePhase&,
                        PhaseMonitor&, const std::function<MeshEnergy()>&);

}  // namespace meshsmooth::detail
