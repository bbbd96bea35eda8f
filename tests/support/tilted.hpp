#pragma once

// Unit cubes, along the axes and oblique to them.

#include <cmath>

#include "support/meshes.hpp"

namespace meshsmooth::test {

/// The unit cube or square of a lattice, jittered.
inline Mesh jittered_unit_lattice(ElementType type, int cells) {
  return mapped(noisy(lattice(type, cells), 0.15, 5), [=](Vec3d p) { return (1.0 / cells) * p; });
}

/// Turned about an oblique axis: planes along the axes are oblique to all of them.
inline Vec3d tilted(Vec3d p) {
  const auto turned = [](Vec3d q, double angle) {
    return Vec3d{q.x * std::cos(angle) - q.y * std::sin(angle),
                 q.x * std::sin(angle) + q.y * std::cos(angle), q.z};
  };
  const Vec3d once = turned(p, 0.6);
  const Vec3d twice = turned({once.y, once.z, once.x}, 0.4);
  return {twice.y, twice.z, twice.x};
}

}  // namespace meshsmooth::test
