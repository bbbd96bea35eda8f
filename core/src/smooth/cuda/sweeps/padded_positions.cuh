#pragma once

#include "smooth/cuda/device/cuda_executor.cuh"

namespace meshsmooth::detail {

/// Positions as gathers like them best, and behind the last node a place of 0: floats
/// by one access of 16 bytes.
template <class R>
class PaddedPositions {
 public:
  using Real = R;

  /// In `memory`, which has room for `size(node_count)`.
  PaddedPositions(R* memory, std::size_t) : places_(reinterpret_cast<FourOf<R>*>(memory)) {}
  static constexpr std::size_t size(std::size_t node_count) { return 4 * (node_count + 1); }

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    const FourOf<R> p = places_[node];
    return {p.values[0], p.values[1], p.values[2]};
  }
  __device__ void store(std::size_t node, Vec3<R> place) const {
    places_[node] = {place.x, place.y, place.z, 0};
  }

 private:
  FourOf<R>* places_;
};

/// Doubles need two accesses; by planes, so that caches hold nothing but positions.
template <>
class PaddedPositions<double> {
 public:
  using Real = double;

  PaddedPositions(double* memory, std::size_t node_count)
      : xy_(reinterpret_cast<double2*>(memory)), z_(memory + 2 * (node_count + 1)) {}
  static constexpr std::size_t size(std::size_t node_count) { return 3 * (node_count + 1); }

  [[nodiscard]] __device__ Vec3d operator[](std::size_t node) const {
    const double2 p = xy_[node];
    return {p.x, p.y, z_[node]};
  }
  __device__ void store(std::size_t node, Vec3d place) const {
    xy_[node] = {place.x, place.y};
    z_[node] = place.z;
  }

 private:
  double2* xy_;
  double* z_;
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
