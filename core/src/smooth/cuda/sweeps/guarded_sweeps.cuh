#pragma once

#include <algorithm>
#include <array>

#include "smooth/cuda/sweeps/sweep_batch.cuh"
#include "smooth/steps/mesh_counts.hpp"

namespace meshsmooth::detail {

/// The elements of a block that a step might break: all others stay positive wherever their nodes
/// are on their ways, and rounds need not visit them.
template <class Limits>
class Suspects {
 public:
  static constexpr bool kPossible = Limits::kOfTetrahedra;

  /// `room`: for all elements of the block; `count`: in shared memory.
  __device__ Suspects(ElementId* room, unsigned int& count) : list_(room), count_(count) {}

  /// Lists the suspects among each `threads`-th element from `first` on, and visits them.
  __device__ void find(const Limits& limits, std::size_t first, std::size_t threads) {
    if (threadIdx.x == 0) count_ = 0;
    __syncthreads();
    for (std::size_t e = first; e < limits.around.elements.count; e += threads) {
      if (limits.stays_positive(e)) continue;
      list_[atomicAdd(&count_, 1U)] = static_cast<ElementId>(e);
      limits.visit_element(e);
    }
    __syncthreads();
  }
  __device__ void visit(const Limits& limits) const {
    for (unsigned int n = threadIdx.x; n < count_; n += kBlockSize) limits.visit_element(list_[n]);
  }

 private:
  ElementId* list_;
  unsigned int& count_;
};

/// What sweeps of Jacobi steps work on. With one step a sweep goes from the first positions to the
/// second, with two on to the third, which become the first.
template <class Step, class Real>
struct GuardedSweeps {
  Step steps[2];
  int step_count;
  Vec3<Real>* positions[3];  // that agree on fixed nodes
  RoundMemory memory;
  ElementId* suspects;
  std::size_t suspects_per_block;

  MESHSMOOTH_HD void rotate() {
    Vec3<Real>* const before = positions[0];
    positions[0] = positions[1];
    positions[1] = step_count == 1 ? before : positions[2];
    positions[2] = before;
  }
};

/// Sweeps of Jacobi steps, whose moves are limited where the acceptance wants it: a thread per node
/// and per element.
/// grid   cooperative: blocks of kBlockSize that are all resident
/// shared one sum per warp
/// needs  rings, and balls for a guard; neither displacement limits nor sliding
/// order  deterministic: sums by a fixed tree
/// equals `run_steps_one_by_one`, bit by bit
template <class Step, class Limits, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    guarded_sweeps_kernel(GuardedSweeps<Step, Real> sweeps, Limits limits, SweepBatch batch) {
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  __shared__ unsigned int suspect_count;
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  Suspects<Limits> suspects(sweeps.suspects + blockIdx.x * sweeps.suspects_per_block,
                            suspect_count);
  const auto grid = cooperative_groups::this_grid();
  const std::size_t threads = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t first = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  const Surroundings& around = limits.around;
  // Where many moves were cut many will be in the next step, which looks for suspects at once.
  bool many_cut = false;
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (int s = 0; s < sweeps.step_count; ++s) {
      limits.before = sweeps.positions[0];
      limits.after = sweeps.positions[1];
      const Step& step = sweeps.steps[s];
      for (int phase = 0; phase < Step::kPhases; ++phase) {
        const bool final_phase = phase + 1 == Step::kPhases;
        for (std::size_t node = first; node < around.node_count; node += threads) {
          if (around.fixed[node] == 0 || !final_phase) step(phase, limits, node);
          if (!final_phase) continue;
          if (s > 0) seen.held += limits.cuts[node] != 0 ? 1 : 0;
          limits.start(node);
        }
        if (first == 0) sweeps.memory.counts[0] = 0;
        grid.sync();
      }
      const bool many_cut_before = many_cut;
      many_cut = false;
      bool sorted_out = false;
      const auto visit = [&](const RoundChanges& changes) {
        many_cut |= changes.nodes != nullptr && !limits.are_few(changes.count);
        if (sorted_out) return suspects.visit(limits);
        if (Suspects<Limits>::kPossible && (many_cut_before || many_cut)) {
          sorted_out = true;
          return suspects.find(limits, first, threads);
        }
        const std::size_t count = limits.visits(changes);
        for (std::size_t n = first; n < count; n += threads) limits.visit(n, changes);
      };
      if (limits.acceptance.guard) {
        run_rounds_in_grid(grid, around.node_count, sweeps.memory, visit,
                           [&](std::size_t node) { return limits.settle(node); });
      }
      sweeps.rotate();
    }
    for (std::size_t node = first; node < around.node_count; node += threads) {
      seen = seen + stats_of_move(sweeps.positions[1][node], sweeps.positions[0][node],
                                  limits.cuts[node] != 0);
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
  }
  report(grid, batch, sweep);
}

/// Bytes of `run_guarded_sweeps` besides those of `limit_moves` and the positions.
[[nodiscard]] constexpr std::int64_t guarded_sweeps_bytes(const MeshCounts& mesh) {
  const std::int64_t rounded_up =
      std::min<std::int64_t>(std::max(mesh.nodes, mesh.elements), 1 << 19);
  return (mesh.elements + rounded_up + kBlockSize) * std::int64_t{sizeof(ElementId)};
}

/// Sweeps of one step or two until the monitor ends them.
template <class Real, class Step, std::size_t kSteps>
void run_guarded_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                        const std::array<Step, kSteps>& steps, ConvergenceMonitor& monitor) {
  static_assert(kSteps == 1 || kSteps == 2);
  const auto run = [&]<bool kTetrahedra>(std::bool_constant<kTetrahedra>) {
    using Limits = MoveLimits<CudaExecutor, kTetrahedra, false, Real>;
    constexpr auto kKernel = &guarded_sweeps_kernel<Step, Limits, Real>;
    const Surroundings& around = sweeper.around();
    const std::size_t node_count = around.node_count, element_count = around.elements.count;
    const unsigned int blocks = cooperative_blocks<kKernel>(
        executor.lane(), block_count(std::max(node_count, element_count)));
    const std::size_t threads = std::size_t{blocks} * kBlockSize;
    const std::size_t per_block = (element_count + threads - 1) / threads * kBlockSize;
    auto flags = executor.allocate<std::uint8_t>(2 * node_count);
    auto list = executor.allocate<NodeId>(node_count);
    auto counts = executor.allocate<unsigned int>(kRoundCounts);
    auto suspects = executor.allocate<ElementId>(kTetrahedra ? blocks * per_block : 0);
    auto third = executor.allocate<Vec3<Real>>(kSteps > 1 ? node_count : 0);
    if (kSteps > 1) sweeper.copy(sweeper.current(), third.data());
    GuardedSweeps<Step, Real> sweeps{{steps.front(), steps.back()},
                                     kSteps,
                                     {sweeper.current(), sweeper.spare(), third.data()},
                                     {flags.data() + node_count, list.data(), counts.data()},
                                     suspects.data(),
                                     per_block};
    const Limits limits{around,       sweeper.acceptance(), {},     nullptr, nullptr,
                        flags.data(), sweeps.memory.marks,  nullptr};
    run_sweep_batches(
        executor, node_count, blocks, monitor,
        [&](const SweepBatch& batch) {
          launch_cooperative<kKernel>(executor.stream(), {blocks}, sweeps, limits, batch);
        },
        [&](int done) {
          for (std::size_t n = 0; n < static_cast<std::size_t>(done) * kSteps; ++n) sweeps.rotate();
        });
    if (kSteps > 1 && sweeps.positions[0] == third.data()) {
      sweeper.copy(third.data(), sweeps.positions[1]);
      sweeps.positions[0] = sweeps.positions[1];
    }
    if (sweeps.positions[0] != sweeper.current()) sweeper.swap();
  };
  if (sweeper.around().elements.tetrahedra) {
    run(std::true_type());
  } else {
    run(std::false_type());
  }
}

}  // namespace meshsmooth::detail
