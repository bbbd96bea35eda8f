#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>

#include "smooth/cuda/base/lane.hpp"
#include "smooth/cuda/base/warp.cuh"

namespace meshsmooth::detail {

inline constexpr unsigned int kBlockSize = 256;
inline constexpr int kWarpsPerBlock = kBlockSize / kWarp;

/// Blocks of kBlockSize that give each of `count` items a thread, at most `most`.
[[nodiscard]] inline unsigned int block_count(std::size_t count, std::size_t most = 1U << 20) {
  return static_cast<unsigned int>(
      std::clamp<std::size_t>((count + kBlockSize - 1) / kBlockSize, 1, most));
}

/// body(i) for each i below `count` that this thread of a grid of kBlockSize visits: a grid-stride
/// loop.
template <class Body>
__device__ __forceinline__ void for_each_in_grid(std::size_t count, const Body& body) {
  const std::size_t threads = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t i = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; i < count;
       i += threads) {
    body(i);
  }
}

struct Grid {
  unsigned int blocks;
  unsigned int block_size = kBlockSize;
  std::size_t shared_bytes = 0;  // dynamic
};

template <auto kKernel, class... Arguments>
void launch(cudaStream_t stream, const Grid& grid, const Arguments&... arguments) {
  kKernel<<<grid.blocks, grid.block_size, grid.shared_bytes, stream>>>(arguments...);
  check_cuda(cudaGetLastError(), "launching a kernel");
}

/// Of a kernel whose blocks wait for each other, see `cooperative_blocks`.
template <auto kKernel, class... Arguments>
void launch_cooperative(cudaStream_t stream, const Grid& grid, Arguments... arguments) {
  void* pointers[] = {&arguments...};
  check_cuda(cudaLaunchCooperativeKernel(kKernel, dim3(grid.blocks), dim3(grid.block_size),
                                         pointers, grid.shared_bytes, stream),
             "launching a cooperative kernel");
}

/// Blocks for a cooperative kernel: `most`, or as many as are resident at the same time. A kernel
/// must always be asked for with the same block size.
template <auto kKernel>
[[nodiscard]] unsigned int cooperative_blocks(const CudaLane& lane, std::size_t most,
                                              unsigned int block_size = kBlockSize) {
  static std::array<std::atomic<int>, kMostDevices> known{};  // by device; 0: not queried yet
  std::atomic<int>& per_multiprocessor = known.at(static_cast<std::size_t>(lane.device()));
  if (per_multiprocessor == 0) {
    int blocks = 0;
    check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kKernel,
                                                             static_cast<int>(block_size), 0),
               "querying a kernel's occupancy");
    per_multiprocessor = std::max(blocks, 1);
  }
  const auto resident =
      static_cast<std::size_t>(per_multiprocessor.load() * lane.multiprocessor_count());
  return static_cast<unsigned int>(std::clamp<std::size_t>(most, 1, resident));
}

/// Raises a kernel's limit of dynamic shared memory above the default, always to the same value.
template <auto kKernel>
void allow_shared_memory(const CudaLane& lane, std::size_t bytes) {
  static std::array<std::atomic<bool>, kMostDevices> done{};
  std::atomic<bool>& here = done.at(static_cast<std::size_t>(lane.device()));
  if (here) return;
  check_cuda(cudaFuncSetAttribute(kKernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                  static_cast<int>(bytes)),
             "raising a kernel's shared memory limit");
  here = true;
}

}  // namespace meshsmooth::detail
