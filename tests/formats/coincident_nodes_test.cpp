#include "coincident_nodes.hpp"

#include <gmock/gmock.h>

#include <limits>

namespace meshsmooth::formats {
namespace {

using ::testing::ElementsAre;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Two triangles that do not share their nodes; 0 and 4 have one position, and so have 2 and 3.
Mesh apart() {
  Mesh mesh;
  mesh.positions =
      std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, -0.0}, {0, 0, 0}, {-1, 0, 0}};
  mesh.blocks = {{ElementType::triangle, {0, 1, 2, 3, 4, 5}}};
  return mesh;
}

TEST(CoincidentNodes, AreOneByTheirLowest) {
  const Mesh mesh = apart();
  const CoincidentNodes nodes(mesh.positions_view());
  EXPECT_EQ(nodes.merged_count(), 2);
  std::vector<NodeId> found;
  for (NodeId node = 0; node < 6; ++node) found.push_back(nodes.representative(node));
  EXPECT_THAT(found, ElementsAre(0, 1, 2, 2, 0, 5));
  EXPECT_EQ(nodes.representative(-1), -1) << "of no node";
  EXPECT_EQ(nodes.representative(6), 6);
}

TEST(CoincidentNodes, AreMergedInElementsAndSpreadAgain) {
  Mesh mesh = apart();
  mesh.fixed = {0, 0, 0, 1, 0, 0};
  const CoincidentNodes nodes(mesh.positions_view());
  nodes.merge(mesh);
  EXPECT_THAT(mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 2, 0, 5));
  EXPECT_THAT(mesh.fixed, ElementsAre(0, 0, 1, 1, 0, 0));
  EXPECT_EQ(mesh.node_count(), 6U);
  auto& points = std::get<std::vector<Vec3d>>(mesh.positions);
  points[0] = {7, 8, 9};
  nodes.spread(mesh);
  EXPECT_EQ(points[4], (Vec3d{7, 8, 9}));
  EXPECT_EQ(points[3], points[2]);
}

TEST(CoincidentNodes, HaveTheSameDigitsAndAreFinite) {
  const std::vector<Vec3d> points = {{1, 0, 0}, {1 + 1e-15, 0, 0}, {kNan, 0, 0}, {kNan, 0, 0}};
  EXPECT_EQ(CoincidentNodes(std::span(points)).merged_count(), 0);
  const std::vector<Vec3f> in_float32 = {{0.1F, 0, 0}, {0.1F, 0, 0}};
  EXPECT_EQ(CoincidentNodes(std::span(in_float32)).merged_count(), 1);
}

}  // namespace
}  // namespace meshsmooth::formats
