#include <gtest/gtest.h>

#include <algorithm>

#include "generated_mesh.hpp"
#include "regions.hpp"

namespace meshsmooth::formats {
namespace {

class LayerTypes : public ::testing::TestWithParam<LayerElements> {};
INSTANTIATE_TEST_SUITE_P(GenerateLayer, LayerTypes,
                         ::testing::Values(LayerElements::hexahedra, LayerElements::wedges,
                                           LayerElements::tetrahedra, LayerElements::quads,
                                           LayerElements::triangles));

TEST_P(LayerTypes, HasTheHeightsAskedFor) {
  const bool plane = GetParam() >= LayerElements::quads;
  for (const double growth : {1.1, 1.25, 1.5}) {
    for (const double first : {1e-3, 1e-5}) {
      const MeshFile file =
          generate_layer({.elements = GetParam(), .first = first, .growth = growth});
      expect_valid(file);
      std::vector<double> levels;
      for (const Vec3d& node : nodes_of(file.mesh)) levels.push_back(plane ? node.y : node.z);
      std::ranges::sort(levels);
      levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
      ASSERT_EQ(levels.size(), 21U);
      EXPECT_EQ(levels[1], first);
      EXPECT_NEAR((levels[20] - levels[19]) / (levels[19] - levels[18]), growth, 1e-9);
      EXPECT_EQ(fixed_count(file), plane ? 26U : 2U * 169);
    }
  }
}

TEST_P(LayerTypes, StaysValidWithJitter) {
  const MeshFile reference = generate_layer({.elements = GetParam()});
  const MeshFile file = generate_layer({.elements = GetParam(), .jitter = 0.3});
  expect_same_elements(file, reference);
  EXPECT_EQ(inverted(file), 0);
  std::size_t moved = 0;
  for (std::size_t node = 0; node < file.mesh.node_count(); ++node) {
    if (nodes_of(file.mesh)[node] != nodes_of(reference.mesh)[node]) ++moved;
  }
  const bool plane = GetParam() >= LayerElements::quads;
  EXPECT_EQ(moved, plane ? 11U * 19 : 11U * 11 * 19);
}

TEST_P(LayerTypes, TanglesTheCoreOnly) {
  const LayerOptions valid{.elements = GetParam(), .core = 8};
  const MeshFile reference = generate_layer(valid);
  expect_valid(reference);
  LayerOptions options = valid;
  options.tangle = 0.3;
  const MeshFile file = generate_layer(options);
  expect_same_elements(file, reference);
  const Regions layers = find_regions(file, kLayerArray);
  const auto core = std::ranges::count(layers.of_element, 0);
  EXPECT_NEAR(double(inverted(file)) / double(core), 0.3, 0.02);
  const bool plane = GetParam() >= LayerElements::quads;
  for (std::size_t node = 0; node < file.mesh.node_count(); ++node) {
    const Vec3d from = nodes_of(reference.mesh)[node];
    if ((plane ? from.y : from.z) < 0.344) {
      ASSERT_EQ(nodes_of(file.mesh)[node], from);
    }
  }
}

TEST(GenerateLayer, NumbersItsLayersAndHasTheQualityOfTheStudy) {
  const MeshFile file = generate_layer({.core = 2});
  const Regions layers = find_regions(file, kLayerArray);
  EXPECT_EQ(layers.of_element.front(), 1);
  EXPECT_EQ(layers.of_element[19U * 144], 20);
  EXPECT_EQ(layers.of_element.back(), 0);
  const QualityStats quality = measure_quality(generate_layer({}).mesh);
  EXPECT_NEAR(quality.metrics[0].mean, 0.414, 0.0005);
}

}  // namespace
}  // namespace meshsmooth::formats
