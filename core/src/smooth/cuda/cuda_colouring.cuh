#pragma once

#include <bit>

#include "smooth/colouring.hpp"
#include "smooth/cuda/cuda_executor.cuh"

namespace meshsmooth::detail {

/// First-fit in the order of `colour_priority`, without rounds: every thread goes
/// through its nodes until all have a colour; a node takes one once all before it
/// have. The blocks must all be there at the same time.
__global__ inline void __launch_bounds__(kBlockSize)
    colour_kernel(Surroundings around, const NodeId* caller_ids, std::uint32_t* colours,
                  std::uint32_t* highest) {
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t own = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  std::uint32_t most = 0;
  for (bool open = true; open;) {
    open = false;
    for (std::size_t node = own; node < around.node_count; node += step) {
      if (around.fixed[node] != 0 || colours[node] != kNoColour) continue;
      if (choose_colour<CudaExecutor>(around, caller_ids, node, colours)) {
        most = max(most, colours[node] + 1);
      } else {
        open = true;
      }
    }
  }
  if (most > 0) atomicMax(highest, most);
}

/// `colour_nodes` on the device: the same colours, two waits.
inline Colouring<CudaExecutor> colour_nodes(CudaExecutor& executor, const Surroundings& around,
                                            const NodeId* caller_ids) {
  const std::size_t node_count = around.node_count;
  auto colours = executor.allocate<std::uint32_t>(node_count);
  auto highest = executor.allocate<std::uint32_t>(1);
  check_cuda(cudaMemsetAsync(colours.data(), 0xff, node_count * sizeof(std::uint32_t),
                             executor.stream()),
             "clearing device memory");
  executor.clear(highest.data(), 1);
  const unsigned int blocks =
      executor.cooperative_blocks<&colour_kernel>(block_count(node_count));
  executor.launch_cooperative<&colour_kernel>(blocks, around, caller_ids, colours.data(),
                                              highest.data());
  std::uint32_t colour_count = 0;
  executor.download(highest.data(), 1, &colour_count);
  executor.check();

  // Stable: nodes of a colour stay in their order. Those without one come last.
  auto sorted = executor.allocate<std::uint32_t>(node_count);
  auto ids = executor.allocate<NodeId>(node_count);
  auto first = executor.allocate<std::uint32_t>(colour_count + 1);
  std::uint32_t* const colour = colours.data();
  NodeId* const id = ids.data();
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    if (colour[node] == kNoColour) colour[node] = colour_count;
    id[node] = static_cast<NodeId>(node);
  });
  Colouring<CudaExecutor> result;
  result.nodes = executor.allocate<NodeId>(node_count);
  executor.with_workspace([&](void* space, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(space, bytes, colour, sorted.data(), id,
                                           result.nodes.data(), node_count, 0,
                                           std::bit_width(colour_count), executor.stream());
  });
  const std::uint32_t* const in_order = sorted.data();
  std::uint32_t* const starts = first.data();
  executor.for_each(node_count, [=] __device__(std::size_t n) {
    if (n == 0 || in_order[n - 1] != in_order[n]) {
      starts[in_order[n]] = static_cast<std::uint32_t>(n);
    }
    if (n + 1 == node_count && in_order[n] != colour_count) {
      starts[colour_count] = static_cast<std::uint32_t>(node_count);
    }
  });
  std::vector<std::uint32_t> host(colour_count + 1);
  executor.download(starts, host.size(), host.data());
  result.first.assign(host.begin(), host.end());
  return result;
}

}  // namespace meshsmooth::detail
