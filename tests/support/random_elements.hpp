#pragma once

// Random elements whose Jacobian may be negative between positive corners.

#include <cstdlib>
#include <random>

#include "support/meshes.hpp"

namespace meshsmooth::test {

inline constexpr ElementType kTypesWithAnInside[] = {ElementType::quad, ElementType::pyramid,
                                                     ElementType::wedge, ElementType::hexahedron};

/// How many of each type and size: MESHSMOOTH_RANDOM_ELEMENTS, 3,000 by default.
inline int random_element_count() {
  const char* const wish = std::getenv("MESHSMOOTH_RANDOM_ELEMENTS");
  return wish == nullptr ? 3000 : std::atoi(wish);
}

/// How far corners are thrown.
inline constexpr double kThrownSizes[] = {0.3, 0.4, 0.5, 0.6};

/// The ideal element, its corners thrown by up to `size` along each axis; quads stay plane.
inline std::vector<Vec3d> thrown_corners(ElementType type, double size, std::mt19937_64& random) {
  std::uniform_real_distribution<double> shift(-size, size);
  const bool surface = element_shape(type).dimension == 2;
  std::vector<Vec3d> corners = ideal_points(type);
  for (Vec3d& p : corners) p += Vec3d{shift(random), shift(random), surface ? 0 : shift(random)};
  return corners;
}

}  // namespace meshsmooth::test
