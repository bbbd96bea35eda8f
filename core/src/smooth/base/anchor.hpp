#pragma once

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// Adds a share of a node's squared distance from home to the energy: it stays convex.
struct Anchor {
  Vec3d home;
  double weight;

  [[nodiscard]] MESHSMOOTH_HD double energy(Vec3d position) const {
    const Vec3d way = position - home;
    return weight * dot(way, way);
  }
};

}  // namespace meshsmooth::detail
