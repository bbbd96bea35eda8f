#pragma once

#include <bit>
#include <cstddef>

#include "meshsmooth/annotations.hpp"
#include "smooth/cuda/base/launch.cuh"

namespace meshsmooth::detail {

/// Folds one value per thread into thread 0's, by a fixed tree. All threads of the block call;
/// `shared` holds one value per thread. (cub::BlockReduce groups otherwise: its sums have other
/// bits.)
template <unsigned int kThreads = kBlockSize, class T, class Combine>
__device__ T reduce_block(T value, T* shared, const Combine& combine) {
  shared[threadIdx.x] = value;
  __syncthreads();
  for (unsigned int width = kThreads / 2; width > 0; width /= 2) {
    if (threadIdx.x < width) {
      shared[threadIdx.x] = combine(shared[threadIdx.x], shared[threadIdx.x + width]);
    }
    __syncthreads();
  }
  value = shared[0];
  __syncthreads();
  return value;
}

/// Folds body(i) for all i below `count` into *result.
/// grid   any number of blocks of kBlockSize
/// shared kBlockSize values
/// needs  one value per block in `partial`, and `ticket` 0, which it is again afterwards
/// order  deterministic for a grid size: each thread folds a fixed stride, the block that finishes
///        last folds the blocks' results by the same tree
/// fast   one launch; the result goes to mapped host memory, without a copy
/// equals `CpuExecutor::reduce`, up to the grouping of rounded sums
template <class T, class Body, class Combine>
__global__ void __launch_bounds__(kBlockSize)
    reduce_kernel(std::size_t count, T zero, Body body, Combine combine, T* partial,
                  unsigned int* ticket, T* result) {
  __shared__ alignas(T) unsigned char bytes[kBlockSize * sizeof(T)];
  __shared__ bool last;
  T* const shared = reinterpret_cast<T*>(bytes);
  T sum = zero;
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t i = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; i < count; i += step) {
    sum = combine(sum, body(i));
  }
  sum = reduce_block(sum, shared, combine);
  if (threadIdx.x == 0) {
    partial[blockIdx.x] = sum;
    __threadfence();
    last = atomicAdd(ticket, 1U) + 1 == gridDim.x;
  }
  __syncthreads();
  if (!last) return;
  __threadfence();
  sum = zero;
  for (unsigned int b = threadIdx.x; b < gridDim.x; b += kBlockSize) {
    sum = combine(sum, partial[b]);
  }
  sum = reduce_block(sum, shared, combine);
  if (threadIdx.x == 0) {
    *result = sum;
    *ticket = 0;
  }
}

/// Maps doubles to integers of the same order, for atomic minima and maxima.
__device__ inline unsigned long long ordered_bits(double value) {
  const auto bits = static_cast<unsigned long long>(__double_as_longlong(value));
  return (bits >> 63) != 0 ? ~bits : bits | (1ULL << 63);
}
MESHSMOOTH_HD inline double from_ordered_bits(unsigned long long ordered) {
  const unsigned long long bits = (ordered >> 63) != 0 ? ordered & ~(1ULL << 63) : ~ordered;
#ifdef __CUDA_ARCH__
  return __longlong_as_double(static_cast<long long>(bits));
#else
  return std::bit_cast<double>(bits);
#endif
}

}  // namespace meshsmooth::detail
