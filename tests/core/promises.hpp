#pragma once

// Promises of Optimize that every backend keeps.

#include <algorithm>

#include "core/smoothing.hpp"

namespace meshsmooth::test {

/// Blocks and balls of `cells`³ hexahedra, thrown about: none of their aspect ratios is meant. In a
/// ball the cubes around the centre turn into spheres outwards.
inline std::vector<std::pair<std::string, Mesh>> isotropic_hexahedra(int cells) {
  std::vector<std::pair<std::string, Mesh>> meshes;
  for (const double jitter : {0.0, 0.1, 0.2, 0.3, 0.4}) {
    const std::string size =
        " of " + std::to_string(cells) + " cells, jitter " + std::to_string(jitter);
    const Mesh block = noisy(lattice(ElementType::hexahedron, cells), jitter, 3);
    meshes.emplace_back("block" + size, block);
    meshes.emplace_back(
        "ball" + size, mapped(block, [=](Vec3d p) {
          const Vec3d q = (2.0 / cells) * p - Vec3d{1, 1, 1};
          const double shell = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
          if (shell == 0) return q;
          return (1 - shell + shell * shell / norm(q)) * q;
        }));
  }
  return meshes;
}

/// What the default makes of the mesh is as good as what ideal shapes do; gives that of the
/// default.
inline Job expect_as_good_as_ideal(Smoother& smoother, const std::string& name, const Mesh& mesh,
                                   double tolerance) {
  Job automatic = smooth_on(smoother, mesh, {});
  const Job ideal = smooth_on(smoother, mesh, {.method = Optimize{.target = Target::ideal}});
  const MetricStats& found = scaled_jacobian(automatic.summary.quality_after);
  const MetricStats& expected = scaled_jacobian(ideal.summary.quality_after);
  EXPECT_GE(found.min, expected.min - tolerance) << name;
  EXPECT_GE(found.mean, expected.mean - tolerance) << name;
  return automatic;
}

}  // namespace meshsmooth::test
