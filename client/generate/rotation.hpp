#pragma once

#include <cmath>
#include <numbers>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::formats {

[[nodiscard]] constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// About the line through `axis` along z, by an angle in degrees; 0 leaves every bit.
[[nodiscard]] inline Vec3d rotated(Vec3d point, Vec3d axis, double degrees) {
  if (degrees == 0) return point;
  const double cosine = std::cos(radians(degrees));
  const double sine = std::sin(radians(degrees));
  const Vec3d arm = point - axis;
  return {axis.x + cosine * arm.x - sine * arm.y, axis.y + sine * arm.x + cosine * arm.y, point.z};
}

}  // namespace meshsmooth::formats
