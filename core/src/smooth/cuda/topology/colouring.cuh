#pragma once

#include <cub/device/device_radix_sort.cuh>

#include <bit>
#include <vector>

#include "smooth/base/colouring_rule.hpp"
#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::detail {

/// The state of a node without a colour, in a mesh of simplices.
struct ColourChoice {
  unsigned long long pending;  // earlier neighbours without a colour, by index in the ring
  unsigned long long taken;    // colours of the other earlier neighbours
};

/// Whether `ColourChoice` can describe the node.
__device__ inline bool has_choice(const Surroundings& around, std::size_t node) {
  return around.elements.simplices() && around.rings.size(node) <= 64;
}

/// `choose_colour`, but each neighbour is read only until it has a colour.
__device__ inline bool choose_colour(const Surroundings& around, const NodeId* caller_ids,
                                     std::size_t node, ColourChoice& choice,
                                     std::uint32_t* colours) {
  ColourChoice now = choice;
  for (unsigned long long open = now.pending; open != 0; open &= open - 1) {
    const int index = __ffsll(static_cast<long long>(open)) - 1;
    const std::uint32_t colour = CudaExecutor::load(colours[around.rings.begin(node)[index]]);
    if (colour == kNoColour) continue;
    if (colour >= 64) return choose_colour<CudaExecutor>(around, caller_ids, node, colours);
    now.pending &= ~(1ULL << index);
    now.taken |= 1ULL << colour;
  }
  choice = now;
  if (now.pending != 0) return false;
  if (~now.taken == 0) return choose_colour<CudaExecutor>(around, caller_ids, node, colours);
  CudaExecutor::store(colours[node],
                      static_cast<std::uint32_t>(__ffsll(static_cast<long long>(~now.taken)) - 1));
  return true;
}

/// First-fit colouring in the order of `colour_priority`, without rounds: every thread polls its
/// nodes until all have a colour; a node takes one once all earlier neighbours have.
/// grid   cooperative: blocks of kBlockSize that are all resident
/// needs  colours all kNoColour, *highest 0
/// order  deterministic: the priorities alone decide
/// fast   no grid barrier and no host in between
/// equals `colour_nodes` of the CPU backend
static __global__ void __launch_bounds__(kBlockSize)
    colour_kernel(Surroundings around, const NodeId* caller_ids, ColourChoice* choices,
                  std::uint32_t* colours, std::uint32_t* highest) {
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  const std::size_t own = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x;
  for (std::size_t node = own; node < around.node_count; node += step) {
    if (around.fixed[node] != 0 || !has_choice(around, node)) continue;
    const std::uint32_t priority = colour_priority(caller_ids[node]);
    const NodeId* const ring = around.rings.begin(node);
    const auto size = static_cast<int>(around.rings.size(node));
    ColourChoice choice{0, 0};
#pragma unroll 4
    for (int k = 0; k < size; ++k) {
      const NodeId other = ring[k];
      const bool before = around.fixed[other] == 0 && colour_priority(caller_ids[other]) > priority;
      choice.pending |= (before ? 1ULL : 0ULL) << k;
    }
    choices[node] = choice;
  }
  std::uint32_t most = 0;
  for (bool open = true; open;) {
    open = false;
    for (std::size_t node = own; node < around.node_count; node += step) {
      if (around.fixed[node] != 0 || colours[node] != kNoColour) continue;
      const bool chosen = has_choice(around, node)
                              ? choose_colour(around, caller_ids, node, choices[node], colours)
                              : choose_colour<CudaExecutor>(around, caller_ids, node, colours);
      if (chosen) {
        most = max(most, colours[node] + 1);
      } else {
        open = true;
      }
    }
  }
  if (most > 0) atomicMax(highest, most);
}

/// The nodes by colour. Stable: nodes of a colour stay in their order; those without one are
/// dropped.
inline Colouring<CudaExecutor> sort_by_colour(CudaExecutor& executor, std::size_t node_count,
                                              std::uint32_t* colour, std::uint32_t colour_count) {
  auto sorted = executor.allocate<std::uint32_t>(node_count);
  auto ids = executor.allocate<NodeId>(node_count);
  auto first = executor.allocate<std::uint32_t>(colour_count + 1);
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

/// Bytes of `colour_nodes`: choices and colours, or what the sort needs.
[[nodiscard]] constexpr std::int64_t colour_search_bytes(std::int64_t node_count) {
  return node_count * 25;
}

/// The colouring of the CPU backend, by the device; the host waits twice.
inline Colouring<CudaExecutor> colour_nodes(CudaExecutor& executor, const Surroundings& around,
                                            const NodeId* caller_ids) {
  const std::size_t node_count = around.node_count;
  auto colours = executor.allocate<std::uint32_t>(node_count);
  auto choices = executor.allocate<ColourChoice>(node_count);
  auto highest = executor.allocate<std::uint32_t>(1);
  check_cuda(
      cudaMemsetAsync(colours.data(), 0xff, node_count * sizeof(std::uint32_t), executor.stream()),
      "clearing device memory");
  executor.clear(highest.data(), 1);
  const unsigned int blocks =
      cooperative_blocks<&colour_kernel>(executor.lane(), block_count(node_count));
  launch_cooperative<&colour_kernel>(executor.stream(), {blocks}, around, caller_ids,
                                     choices.data(), colours.data(), highest.data());
  std::uint32_t colour_count = 0;
  executor.download(highest.data(), 1, &colour_count);
  executor.check();
  choices = {};
  return sort_by_colour(executor, node_count, colours.data(), colour_count);
}

}  // namespace meshsmooth::detail
