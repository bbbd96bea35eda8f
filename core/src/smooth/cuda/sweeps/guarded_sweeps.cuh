#pragma once

#include <algorithm>
#include <array>
#include <type_traits>

#include "smooth/base/mesh_counts.hpp"
#include "smooth/cuda/primitives/flagged_barrier.cuh"
#include "smooth/cuda/sweeps/cut_moves.cuh"
#include "smooth/cuda/sweeps/sweep_batch.cuh"

namespace meshsmooth::detail {

/// What sweeps of Jacobi steps work on. With one step a sweep goes from the first positions to the
/// second, with two on to the third, which become the first.
template <class Step, class Real>
struct GuardedSweeps {
  Step steps[2];
  int step_count;
  Vec3<Real>* positions[3];  // that agree on fixed nodes
  unsigned long long* barrier;
  // For the guard; otherwise null.
  unsigned int* cuts;
  BoundingSphere* spheres;
  ElementId* suspects;
  std::size_t suspects_per_block;

  MESHSMOOTH_HD void rotate() {
    Vec3<Real>* const before = positions[0];
    positions[0] = positions[1];
    positions[1] = step_count == 1 ? before : positions[2];
    positions[2] = before;
  }
};

/// Sweeps of Jacobi steps, whose moves are cut until no valid element is inverted, as by
/// `limit_moves`.
/// grid   cooperative: blocks of kBlockSize that are all resident
/// shared the block's suspects, one sum per warp
/// needs  rings, and the elements for a guard; neither displacement limits nor sliding
/// order  deterministic: sums by a fixed tree
/// equals `run_steps_one_by_one`, bit by bit
template <class Step, bool kTetrahedra, class Real>
__global__ void __launch_bounds__(kBlockSize, 2)
    guarded_sweeps_kernel(GuardedSweeps<Step, Real> sweeps, Surroundings around, SweepBatch batch) {
  using Rounds = std::conditional_t<kTetrahedra, Suspects<Real>, AllElements<Real>>;
  __shared__ alignas(SweepStats) unsigned char bytes[kWarpsPerBlock * sizeof(SweepStats)];
  __shared__ typename Rounds::Room room;
  SweepStats* const shared = reinterpret_cast<SweepStats*>(bytes);
  Rounds elements(around, sweeps.suspects + blockIdx.x * sweeps.suspects_per_block, room);
  const bool guard = sweeps.cuts != nullptr;
  const MoveCuts cuts(sweeps.cuts);
  const auto grid = cooperative_groups::this_grid();
  FlaggedBarrier barrier(sweeps.barrier);
  const auto for_own_nodes = [&](const auto& body) { for_each_in_grid(around.node_count, body); };
  const Vec3d origin = vec3_cast<double>(sweeps.positions[0][0]);
  int sweep = 0;
  for (bool last = false; !last; ++sweep) {
    SweepStats seen;
    for (int s = 0; s < sweeps.step_count; ++s) {
      if (s > 0) barrier.wait();
      const Vec3<Real>* const before = sweeps.positions[0];
      Vec3<Real>* const after = sweeps.positions[1];
      const StepPositions<Real> in{around, {}, before, after};
      for (int phase = 0; phase < Step::kPhases; ++phase) {
        const bool final_phase = phase + 1 == Step::kPhases;
        for_own_nodes([&](std::size_t node) {
          if (around.fixed[node] == 0 || !final_phase) sweeps.steps[s](phase, in, node);
          if (kTetrahedra && guard && final_phase) {
            sweeps.spheres[node] = bounding_sphere_of_move(before[node], after[node], origin);
          }
        });
        if (guard || !final_phase) barrier.wait();
      }
      if (guard) {
        const CutStep<Real> step{before, after, cuts};
        elements.find(step, sweeps.spheres);
        int round = 0;
        while (barrier.wait(elements.visit(step, round))) {
          if (++round < MoveCuts::kRounds) continue;
          for_own_nodes([&](std::size_t node) { cuts.fold(node); });
          barrier.wait();
          round = 1;
        }
      }
      const bool final_step = s + 1 == sweeps.step_count;
      for_own_nodes([&](std::size_t node) {
        const int cut = guard ? cuts.take(node) : 0;
        if (cut == 0 && !final_step) return;
        const Vec3<Real> from = before[node];
        Vec3<Real> to = after[node];
        const bool held = cut > 0 && !(from == to);
        if (held) after[node] = to = cut_move(from, to, cut);
        if (final_step) {
          seen = seen + stats_of_move(s == 0 ? from : sweeps.positions[2][node], to, held);
        } else {
          seen.held += held ? 1 : 0;
        }
      });
      sweeps.rotate();
    }
    last = end_sweep(grid, batch, sweep, seen, shared);
  }
  report(grid, batch, sweep);
}

/// Bytes of `run_guarded_sweeps` besides the positions.
[[nodiscard]] inline std::int64_t guarded_sweeps_bytes(const MeshCounts& mesh) {
  std::int64_t bytes = mesh.nodes * std::int64_t{sizeof(unsigned int)};
  if (!mesh.only(4)) return bytes;
  const std::int64_t rounded_up =
      std::min<std::int64_t>(std::max(mesh.nodes, mesh.elements), 1 << 19);
  bytes += mesh.nodes * std::int64_t{sizeof(BoundingSphere)};
  return bytes + (mesh.elements + rounded_up + kBlockSize) * std::int64_t{sizeof(ElementId)};
}

/// Sweeps of one step or two until the monitor ends them.
template <class Real, class Step, std::size_t kSteps>
void run_guarded_sweeps(CudaExecutor& executor, Sweeper<CudaExecutor, Real>& sweeper,
                        const std::array<Step, kSteps>& steps, ConvergenceMonitor& monitor) {
  static_assert(kSteps == 1 || kSteps == 2);
  const auto run = [&]<bool kTetrahedra>(std::bool_constant<kTetrahedra>) {
    constexpr auto kKernel = &guarded_sweeps_kernel<Step, kTetrahedra, Real>;
    const Surroundings& around = sweeper.around();
    const std::size_t node_count = around.node_count, element_count = around.elements.count;
    const bool guard = sweeper.acceptance().guard, lists = guard && kTetrahedra;
    const unsigned int blocks = cooperative_blocks<kKernel>(
        executor.lane(), block_count(std::max(node_count, element_count)));
    const std::size_t threads = std::size_t{blocks} * kBlockSize;
    const std::size_t per_block = (element_count + threads - 1) / threads * kBlockSize;
    auto barrier = executor.allocate<unsigned long long>(FlaggedBarrier::kWords);
    auto cuts = executor.allocate<unsigned int>(guard ? node_count : 0);
    auto spheres = executor.allocate<BoundingSphere>(lists ? node_count : 0);
    auto suspects = executor.allocate<ElementId>(lists ? blocks * per_block : 0);
    auto third = executor.allocate<Vec3<Real>>(kSteps > 1 ? node_count : 0);
    if (guard) executor.clear(cuts.data(), node_count);
    if (kSteps > 1) sweeper.copy(sweeper.current(), third.data());
    GuardedSweeps<Step, Real> sweeps{{steps.front(), steps.back()},
                                     kSteps,
                                     {sweeper.current(), sweeper.spare(), third.data()},
                                     barrier.data(),
                                     guard ? cuts.data() : nullptr,
                                     spheres.data(),
                                     suspects.data(),
                                     per_block};
    run_sweep_batches(
        executor, node_count, blocks, monitor,
        [&](const SweepBatch& batch) {
          executor.clear(barrier.data(), FlaggedBarrier::kWords);
          launch_cooperative<kKernel>(executor.stream(), {blocks}, sweeps, around, batch);
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
