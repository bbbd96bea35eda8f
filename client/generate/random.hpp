#pragma once

#include <cstdint>
#include <random>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::formats {

/// The same numbers everywhere: the standard fixes this engine's output, but
/// not that of its distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [lower, upper).
  double between(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1.0p-53);
  }
  /// In the cube [-size, size)³.
  Vec3d vector(double size) {
    const double x = between(-size, size);
    const double y = between(-size, size);
    return {x, y, between(-size, size)};
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace meshsmooth::formats
