#pragma once

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// A team: kSize threads of one warp that work on one node.
template <int kSize>
struct WarpTeam {
  static constexpr int size = kSize;
  int rank;
  unsigned int mask;

  __device__ WarpTeam()
      : rank(static_cast<int>(threadIdx.x % size)),
        mask(size == 32 ? 0xffffffffU
                        : ((1U << (size % 32)) - 1) << (threadIdx.x % 32 / size * size)) {}

  [[nodiscard]] __device__ double lowest(double value) const {
    for (int step = size / 2; step > 0; step /= 2) {
      const double other = __shfl_xor_sync(mask, value, step);
      if (other < value) value = other;
    }
    return value;
  }
  /// Butterfly reduction: all threads get the same bits.
  [[nodiscard]] __device__ double sum(double value) const {
    for (int step = size / 2; step > 0; step /= 2) value += __shfl_xor_sync(mask, value, step);
    return value;
  }
  template <class T>
  [[nodiscard]] __device__ Vec3<T> sum(Vec3<T> value) const {
    for (int step = size / 2; step > 0; step /= 2) {
      value += Vec3<T>{__shfl_xor_sync(mask, value.x, step), __shfl_xor_sync(mask, value.y, step),
                       __shfl_xor_sync(mask, value.z, step)};
    }
    return value;
  }
  [[nodiscard]] __device__ bool all(bool value) const { return __all_sync(mask, value) != 0; }
};

}  // namespace meshsmooth::detail
