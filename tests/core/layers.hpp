#pragma once

// Boundary layers, perfect and jittered, for the tests of what elements aim at.

#include "core/smoothing.hpp"
#include "generate/cases.hpp"

namespace meshsmooth::test {

struct LayerCase {
  formats::LayerElements elements;
  double growth;
  double first;

  [[nodiscard]] Mesh mesh(double jitter = 0) const {
    return formats::generate_layer(
               {.elements = elements, .first = first, .growth = growth, .jitter = jitter})
        .mesh;
  }
  /// 30 % of the height of the top layers is eight times the width of their cells.
  [[nodiscard]] bool badly_tangled_by_jitter() const { return growth == 1.5 && first == 1e-3; }
  [[nodiscard]] std::string name() const {
    return "layer " + std::to_string(static_cast<int>(elements)) + ", growth " +
           std::to_string(growth) + ", first " + std::to_string(first);
  }
};

inline std::vector<LayerCase> layer_cases(std::initializer_list<formats::LayerElements> types) {
  std::vector<LayerCase> cases;
  for (const formats::LayerElements type : types) {
    for (const double growth : {1.1, 1.25, 1.5}) {
      for (const double first : {1e-3, 1e-4, 1e-5}) cases.push_back({type, growth, first});
    }
  }
  return cases;
}

/// The mean height of the first layer above the inside of its wall.
inline double first_height(const Mesh& mesh, const Mesh& clean, double first) {
  const std::vector<Vec3d> x = points_as_double(mesh);
  const std::vector<Vec3d> home = points_as_double(clean);
  double sum = 0;
  int count = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    if (std::abs(home[n].z - first) > 0.01 * first) continue;
    if (home[n].x == 0 || home[n].y == 0 || home[n].x == 1 || home[n].y == 1) continue;
    sum += x[n].z;
    ++count;
  }
  return sum / count;
}

/// Smooths the jittered layer by the default alone.
inline Job expect_straightened(Smoother& smoother, const LayerCase& c) {
  Job job = smooth_on(smoother, c.mesh(0.3), {});
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << c.name();
  EXPECT_GE(scaled_jacobian(job.summary.quality_after).min,
            c.badly_tangled_by_jitter() ? 0.9 : 0.95)
      << c.name();
  EXPECT_NEAR(first_height(job.mesh, c.mesh(), c.first), c.first, 0.05 * c.first) << c.name();
  return job;
}

}  // namespace meshsmooth::test
