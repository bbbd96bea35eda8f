#include <algorithm>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/device_session.cuh"
#include "smooth/cuda/primitives/flagged_barrier.cuh"
#include "smooth/cuda/sweeps/cut_moves.cuh"

namespace meshsmooth::test {
namespace {

/// What `cut_kernel` reads and writes, in device memory.
struct CutRounds {
  std::size_t node_count;
  int round_count;
  const std::uint8_t* demands;  // [round][node]
  unsigned int* words;
  unsigned long long* barrier;
  int* cuts;                 // [node]
  std::uint8_t* broken;      // [round][block]
  std::uint8_t* consistent;  // [node]
};

/// The loop over rounds of `guarded_sweeps_kernel`, with demands that are given.
__global__ void __launch_bounds__(detail::kBlockSize) cut_kernel(CutRounds job) {
  const detail::MoveCuts cuts(job.words);
  detail::FlaggedBarrier barrier(job.barrier);
  const auto for_each_node = [&](const auto& body) {
    detail::for_each_in_grid(job.node_count, body);
  };
  for_each_node([&](std::size_t node) { job.consistent[node] = 1; });
  for (int n = 0, round = 0; n < job.round_count; ++n, ++round) {
    const auto demanded = [&](int earlier, std::size_t node) {
      return job.demands[static_cast<std::size_t>(earlier) * job.node_count + node] != 0;
    };
    if (round == detail::MoveCuts::kRounds) {
      for_each_node([&](std::size_t node) { cuts.fold(node); });
      barrier.wait();
      round = 1;
    }
    bool any = false;
    for_each_node([&](std::size_t node) {
      if (demanded(n, node)) cuts.demand(round, node);
      any |= demanded(n, node);
      int before = 0;
      for (int earlier = 0; earlier < n; ++earlier) before += demanded(earlier, node) ? 1 : 0;
      const unsigned int word = cuts.word_before(round, node);
      const auto capped = [](int count) { return min(count, detail::kMoveTrials); };
      const bool same = capped(detail::MoveCuts::count(word)) == capped(before) &&
                        (n == 0 || detail::MoveCuts::changed(round, word) == demanded(n - 1, node));
      if (!same) job.consistent[node] = 0;
    });
    const bool raised = barrier.wait(any);
    if (threadIdx.x == 0) {
      job.broken[static_cast<std::size_t>(n) * gridDim.x + blockIdx.x] = raised ? 1 : 0;
    }
  }
  for_each_node([&](std::size_t node) { job.cuts[node] = cuts.take(node); });
}

}  // namespace

DeviceCuts cut_on_device(std::size_t node_count, const std::vector<std::vector<NodeId>>& demands) {
  DeviceSession device;
  detail::CudaExecutor& executor = device.executor;
  std::vector<std::uint8_t> table(demands.size() * node_count);
  for (std::size_t n = 0; n < demands.size(); ++n) {
    for (const NodeId node : demands[n]) table[n * node_count + static_cast<std::size_t>(node)] = 1;
  }
  const auto there = uploaded(executor, table);
  const unsigned int blocks =
      detail::cooperative_blocks<&cut_kernel>(device.lane, detail::block_count(node_count));
  auto words = executor.allocate<unsigned int>(node_count);
  auto barrier = executor.allocate<unsigned long long>(detail::FlaggedBarrier::kWords);
  auto cuts = executor.allocate<int>(node_count);
  auto broken = executor.allocate<std::uint8_t>(demands.size() * blocks);
  auto consistent = executor.allocate<std::uint8_t>(node_count);
  executor.clear(words.data(), node_count);
  executor.clear(barrier.data(), detail::FlaggedBarrier::kWords);
  detail::launch_cooperative<&cut_kernel>(
      executor.stream(), {blocks},
      CutRounds{node_count, static_cast<int>(demands.size()), there.data(), words.data(),
                barrier.data(), cuts.data(), broken.data(), consistent.data()});
  DeviceCuts result;
  result.cuts = downloaded(executor, cuts.data(), node_count);
  const auto reported = downloaded(executor, broken.data(), broken.size());
  for (std::size_t n = 0; n < demands.size(); ++n) {
    const auto row = reported.begin() + static_cast<std::ptrdiff_t>(n * blocks);
    result.broken.emplace_back(row, row + static_cast<std::ptrdiff_t>(blocks));
  }
  const auto same = downloaded(executor, consistent.data(), node_count);
  result.consistent.assign(same.begin(), same.end());
  return result;
}

}  // namespace meshsmooth::test
