#pragma once

// Promises of Optimize that every backend keeps.

#include <algorithm>
#include <array>

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

/// Of the elements of a result that have a node that may move.
struct WorstElements {
  double mean_ratio = 1;
  double dihedral_angle = 180;  // of tetrahedra
};

/// In both respects goal `worst` leaves at least what `balanced` does; gives both, `balanced`
/// first.
inline std::array<WorstElements, 2> expect_worst_no_worse_than_balanced(Smoother& smoother,
                                                                        const std::string& name,
                                                                        const Mesh& mesh) {
  const std::vector<oracle::Element> elements = oracle::elements(mesh);
  const std::vector<bool> held = oracle::held_nodes(mesh);
  std::array<WorstElements, 2> result;
  for (const Goal goal : {Goal::balanced, Goal::worst}) {
    const Job job = smooth_on(smoother, mesh,
                              {.method = Optimize{.goal = goal},
                               .element_quality_metrics = {QualityMetric::mean_ratio,
                                                           QualityMetric::min_dihedral_angle}});
    WorstElements& worst = result[goal == Goal::worst ? 1 : 0];
    for (std::size_t e = 0; e < elements.size(); ++e) {
      if (std::ranges::all_of(elements[e].nodes, [&](NodeId n) { return held[n]; })) continue;
      const ElementQualityArrays& found = job.summary.element_quality;
      worst.mean_ratio = std::min<double>(worst.mean_ratio, found.of(0)[e]);
      // Passes over NaN.
      worst.dihedral_angle = std::fmin(worst.dihedral_angle, found.of(1)[e]);
    }
  }
  EXPECT_GE(result[1].mean_ratio, result[0].mean_ratio) << name;
  EXPECT_GE(result[1].dihedral_angle, result[0].dihedral_angle) << name;
  return result;
}

}  // namespace meshsmooth::test
