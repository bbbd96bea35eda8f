#pragma once

#include <cstdint>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// The box of all nodes.
struct Box {
  Vec3d lower, upper;
  [[nodiscard]] MESHSMOOTH_HD double diagonal() const { return norm(upper - lower); }
};

/// Index of a cell along Hilbert's curve through a grid of 2^bits cells a side.
/// Source: Skilling 2004, "Programming the Hilbert curve", AIP Conf. Proc. 707.
MESHSMOOTH_HD inline std::uint64_t hilbert_key(std::uint32_t x, std::uint32_t y, std::uint32_t z,
                                               int bits) {
  std::uint32_t axis[3] = {x, y, z};
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1) {
    const std::uint32_t low = q - 1;
    for (std::uint32_t& a : axis) {
      if ((a & q) != 0) {
        axis[0] ^= low;
      } else {
        const std::uint32_t swapped = (axis[0] ^ a) & low;
        axis[0] ^= swapped;
        a ^= swapped;
      }
    }
  }
  axis[1] ^= axis[0];
  axis[2] ^= axis[1];
  std::uint32_t flip = 0;
  for (std::uint32_t q = 1U << (bits - 1); q > 1; q >>= 1) {
    if ((axis[2] & q) != 0) flip ^= q - 1;
  }
  std::uint64_t key = 0;
  for (int bit = bits - 1; bit >= 0; --bit) {
    for (const std::uint32_t a : axis) key = (key << 1) | (((a ^ flip) >> bit) & 1U);
  }
  return key;
}

/// `hilbert_key` of a position in its box.
template <class Real>
MESHSMOOTH_HD std::uint64_t hilbert_index(Vec3<Real> position, const Box& box, int bits) {
  const Vec3d extent = box.upper - box.lower;
  double longest = extent.x > extent.y ? extent.x : extent.y;
  if (extent.z > longest) longest = extent.z;
  const double scale = longest > 0 ? static_cast<double>((1U << bits) - 1) / longest : 0.0;
  const Vec3d p = scale * (vec3_cast<double>(position) - box.lower);
  return hilbert_key(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                     static_cast<std::uint32_t>(p.z), bits);
}

}  // namespace meshsmooth::detail
