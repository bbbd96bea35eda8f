#pragma once

#include "smooth/base/mesh_counts.hpp"
#include "smooth/cuda/primitives/executor.cuh"
#include "smooth/cuda/primitives/vector_access.cuh"

namespace meshsmooth::detail {

/// Positions laid out for gathers, and after the last node a position of 0. Floats are padded to 16
/// bytes: one vector load each.
template <class R>
class PaddedPositions {
 public:
  using Real = R;

  /// In `memory` of `size(node_count)` values.
  PaddedPositions(R* memory, std::size_t) : positions_(reinterpret_cast<FourOf<R>*>(memory)) {}
  static constexpr std::size_t size(std::size_t node_count) { return 4 * (node_count + 1); }

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    const FourOf<R> p = positions_[node];
    return {p.values[0], p.values[1], p.values[2]};
  }
  __device__ void store(std::size_t node, Vec3<R> position) const {
    positions_[node] = {position.x, position.y, position.z, 0};
  }

 private:
  FourOf<R>* positions_;
};

/// Doubles take two loads; in two planes, so that no cache line holds padding (Jacobi at 1M 65.4 to
/// 48.7 us, H200).
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
  __device__ void store(std::size_t node, Vec3d position) const {
    xy_[node] = {position.x, position.y};
    z_[node] = position.z;
  }

 private:
  double2* xy_;
  double* z_;
};

[[nodiscard]] inline std::int64_t padded_bytes(const MeshCounts& mesh) {
  return mesh.nodes * (mesh.position_bytes == 12 ? 16 : 24);
}

template <class Given, class Real>
void pad_positions(CudaExecutor& executor, std::size_t node_count, const Vec3<Given>* from,
                   PaddedPositions<Real> to) {
  executor.for_each(node_count + 1, [=] __device__(std::size_t node) {
    const Vec3<Given> position = node < node_count ? from[node] : Vec3<Given>{0, 0, 0};
    to.store(node, vec3_cast<Real>(position));
  });
}
template <class Real>
void unpad_positions(CudaExecutor& executor, std::size_t node_count, PaddedPositions<Real> from,
                     Vec3<Real>* to) {
  executor.for_each(node_count, [=] __device__(std::size_t node) { to[node] = from[node]; });
}

}  // namespace meshsmooth::detail
