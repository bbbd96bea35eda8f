#pragma once

#include "smooth/cuda/cuda_executor.cuh"

namespace meshsmooth::detail {

/// Positions that a neighbour's comes by one access, and behind the last node a place
/// of 0.
template <class R>
struct PaddedPositions {
  using Real = R;
  FourOf<R>* data;

  static constexpr std::size_t size(std::size_t node_count) { return node_count + 1; }

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    const FourOf<R> p = data[node];
    return {p.values[0], p.values[1], p.values[2]};
  }
  __device__ void store(std::size_t node, Vec3<R> place) const {
    data[node] = {place.x, place.y, place.z, 0};
  }
};

template <class Real>
void pad_positions(CudaExecutor& executor, std::size_t node_count, const Vec3<Real>* from,
                   PaddedPositions<Real> to) {
  executor.for_each(node_count + 1, [=] __device__(std::size_t node) {
    const Vec3<Real> place = node < node_count ? from[node] : Vec3<Real>{0, 0, 0};
    to.store(node, place);
  });
}
template <class Real>
void unpad_positions(CudaExecutor& executor, std::size_t node_count, PaddedPositions<Real> from,
                     Vec3<Real>* to) {
  executor.for_each(node_count, [=] __device__(std::size_t node) { to[node] = from[node]; });
}

}  // namespace meshsmooth::detail
