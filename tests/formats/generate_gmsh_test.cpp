#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "generated_mesh.hpp"

namespace meshsmooth::formats {
namespace {

#if defined(MESHSMOOTH_WITH_GMSH)

TEST(GenerateFlap, IsTheChannelOfTurekAndHron) {
  const MeshFile file = generate_flap({});
  expect_valid(file);
  const double root = 0.2 + std::sqrt(0.0024);
  const double half = std::asin(0.01 / 0.05);  // of the cylinder inside the flap
  const double cylinder = 0.0025 * M_PI;
  const double flap = 0.02 * (0.6 - root) - 0.0025 * (half - 0.2 * std::cos(half));
  EXPECT_NEAR(measure_quality(file.mesh).sum_absolute_volume, 2.5 * 0.41 - cylinder - flap, 1e-4);
  EXPECT_GT(least(file, QualityMetric::mean_ratio), 0.5);
  for (const NodeId node : find_node_set(file, kFixedArray)) {
    const Vec3d at = nodes_of(file.mesh)[static_cast<std::size_t>(node)];
    const bool on_cylinder = std::abs(std::hypot(at.x - 0.2, at.y - 0.2) - 0.05) < 1e-9;
    const bool on_flap = at.x > 0.24 && std::abs(at.y - 0.2) < 0.01 + 1e-9;
    ASSERT_TRUE(on_cylinder || on_flap) << "node " << node;
  }
}

TEST(GenerateFlap, CurvesWithoutStretching) {
  const MeshFile reference = generate_flap({});
  const auto& start = nodes_of(reference.mesh);
  const auto tip =
      std::ranges::find_if(
          start,
          [](Vec3d p) { return std::abs(p.x - 0.6) < 1e-12 && std::abs(p.y - 0.21) < 1e-12; }) -
      start.begin();
  const auto corner = static_cast<std::size_t>(tip);
  for (const double share : {0.3, 0.8, -0.8}) {
    const MeshFile file = generate_flap({.tip = share});
    expect_same_elements(file, reference);
    EXPECT_GT(inverted(file), 0);
    const Vec3d at = nodes_of(file.mesh)[corner];
    const double angle = std::abs(2 * std::atan2(at.y - 0.21, at.x - 0.25));  // about
    const double rise = (share > 0 ? 0.2 : 0.19) * share;
    EXPECT_NEAR(at.y - 0.01 * std::cos(angle), 0.2 + rise, 0.003) << share;
  }
  const Vec3d at = nodes_of(generate_flap({.degrees = 60}).mesh)[corner];
  const double radius = 0.35 / (M_PI / 3) - 0.01;
  EXPECT_NEAR(at.x, 0.25 + radius * std::sin(M_PI / 3), 1e-12);
  EXPECT_NEAR(at.y, 0.21 + radius * (1 - std::cos(M_PI / 3)), 1e-12);
}

TEST(GenerateBoxSphere, MovesTheSphereOnly) {
  const MeshFile reference = generate_box_sphere({.size = 0.1});
  expect_valid(reference);
  EXPECT_NEAR(measure_quality(reference.mesh).sum_absolute_volume, 1 - 0.0335, 0.005);
  const MeshFile moved = generate_box_sphere({.size = 0.1, .move = 0.8});
  expect_same_elements(moved, reference);
  EXPECT_GT(inverted(moved), 0);
  EXPECT_GT(fixed_count(moved), 20U);
  std::vector<NodeId> changed;
  for (std::size_t node = 0; node < moved.mesh.node_count(); ++node) {
    const Vec3d step = nodes_of(moved.mesh)[node] - nodes_of(reference.mesh)[node];
    if (step == Vec3d{}) continue;
    changed.push_back(static_cast<NodeId>(node));
    ASSERT_NEAR(step.x, 0.24, 1e-12);
    ASSERT_NEAR(norm(nodes_of(reference.mesh)[node] - Vec3d{0.5, 0.5, 0.5}), 0.2, 1e-9);
  }
  EXPECT_EQ(changed, find_node_set(moved, kFixedArray));
}

TEST(GenerateFlap, IsTheSameEveryTimeAndRefusesWhatItCannotMake) {
  EXPECT_EQ(hash_of(generate_flap({.tip = 0.5}).mesh), hash_of(generate_flap({.tip = 0.5}).mesh));
  EXPECT_EQ(hash_of(generate_box_sphere({.size = 0.15}).mesh),
            hash_of(generate_box_sphere({.size = 0.15}).mesh));
  EXPECT_EQ(error_of([] { return generate_flap({.tip = 0.5, .degrees = 3}); }),
            "tip and degrees: choose one");
  EXPECT_EQ(error_of([] { return generate_flap({.tip = 1}); }), "tip 1 is not in [-0.95, 0.95]");
  EXPECT_EQ(error_of([] { return generate_box_sphere({.radius = 0.6}); }),
            "radius 0.6 is not in [0.05, 0.45]");
}

#else

TEST(GenerateCases, NeedGmshForSome) {
  EXPECT_THROW((void)generate_flap({}), NotSupported);
  EXPECT_THROW((void)generate_box_sphere({}), NotSupported);
}

#endif

}  // namespace
}  // namespace meshsmooth::formats
