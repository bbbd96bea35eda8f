#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/target_surface.hpp"
#include "surface/checkpoint.hpp"

namespace meshsmooth::detail {

/// A chain of feature edges from corner to corner, or a loop (`points` ends where it begins).
struct SurfaceCurve {
  std::vector<std::int32_t> points;
  std::int32_t ends[2];  // numbers of corners; -1, -1: a loop without one
  double angle;          // mean of those at its edges, in degrees; 180 where it is certainly one

  [[nodiscard]] bool closed() const { return ends[0] < 0; }
};

/// The parts of a surface.
struct SurfaceFeatures {
  std::vector<std::int32_t> patch_of;  // by triangle, from 0 on
  std::int32_t patch_count = 0;
  std::vector<SurfaceCurve> curves;
  std::vector<std::int32_t> corners;  // points, ascending
};

/// Finds the parts of a surface without repeated points. O(triangles log triangles).
///
/// takes  `bends`: creases that are no features
/// gives  `counts` of the parts and of unusual edges
[[nodiscard]] SurfaceFeatures find_features(const SurfaceMesh& mesh, double feature_angle,
                                            std::span<const std::array<std::int32_t, 2>> bends,
                                            SurfaceCounts& counts, Checkpoint& checkpoint);

}  // namespace meshsmooth::detail
