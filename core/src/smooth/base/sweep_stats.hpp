#pragma once

#include <cstdint>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// What one sweep did.
struct SweepStats {
  double max_squared = 0;  // largest squared move
  double sum_squared = 0;
  std::int64_t moved = 0;
  std::int64_t held = 0;

  friend MESHSMOOTH_HD SweepStats operator+(const SweepStats& a, const SweepStats& b) {
    return {a.max_squared > b.max_squared ? a.max_squared : b.max_squared,
            a.sum_squared + b.sum_squared, a.moved + b.moved, a.held + b.held};
  }
};

template <class Real>
MESHSMOOTH_HD SweepStats stats_of_move(Vec3<Real> before, Vec3<Real> after, bool held) {
  const Vec3d move = vec3_cast<double>(after) - vec3_cast<double>(before);
  const double squared = dot(move, move);
  return {squared, squared, before == after ? 0 : 1, held ? 1 : 0};
}

}  // namespace meshsmooth::detail
