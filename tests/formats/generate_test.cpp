#include "generate/generate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "meshsmooth/error.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::formats {
namespace {

const std::vector<Vec3d>& nodes_of(const Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}

void expect_valid(const Mesh& mesh) {
  const MeshTopology topology(mesh);
  EXPECT_NO_THROW(validate(topology.view(), mesh.positions_view()));
  const QualityStats quality = measure_quality(mesh);
  EXPECT_EQ(quality.inverted_count, 0);
  EXPECT_EQ(quality.degenerate_count, 0);
}

/// How many elements use each facet, by its sorted nodes. Two that meet in a
/// quad and in two triangles would show as facets used once inside.
std::map<std::vector<NodeId>, int> facet_uses(const Mesh& mesh) {
  std::map<std::vector<NodeId>, int> uses;
  for (const ElementBlock& block : mesh.blocks) {
    const ElementShape& shape = element_shape(block.type);
    for (std::size_t first = 0; first < block.nodes.size();
         first += static_cast<std::size_t>(shape.node_count)) {
      for (int facet = 0; facet < shape.facet_count; ++facet) {
        const FacetShape& local = shape.facets[static_cast<std::size_t>(facet)];
        std::vector<NodeId> key;
        for (int corner = 0; corner < local.node_count; ++corner) {
          const auto node = static_cast<std::size_t>(local.nodes[static_cast<std::size_t>(corner)]);
          key.push_back(block.nodes[first + node]);
        }
        std::sort(key.begin(), key.end());
        ++uses[key];
      }
    }
  }
  return uses;
}

/// Facets used once lie on the boundary, where all their nodes satisfy `is_on`.
template <class IsOn>
void expect_conforming(const Mesh& mesh, IsOn is_on) {
  for (const auto& [facet, count] : facet_uses(mesh)) {
    ASSERT_LE(count, 2);
    if (count == 2) continue;
    for (const NodeId node : facet) {
      ASSERT_TRUE(is_on(nodes_of(mesh)[static_cast<std::size_t>(node)])) << "node " << node;
    }
  }
}

bool is_on_unit_cube(Vec3d p) {
  const auto at_end = [](double x) { return x == 0 || x == 1; };
  return at_end(p.x) || at_end(p.y) || at_end(p.z);
}

void expect_all_nodes_used(const Mesh& mesh) {
  std::vector<bool> used(mesh.node_count());
  for (const ElementBlock& block : mesh.blocks) {
    for (const NodeId node : block.nodes) used[static_cast<std::size_t>(node)] = true;
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

#if defined(MESHSMOOTH_WITH_TETGEN)

class CubeSizes : public ::testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(GenerateCube, CubeSizes,
                         ::testing::Values(27, 28, 60, 100, 125, 1000, 5000, 10000));

TEST_P(CubeSizes, HasExactlyTheNodesAndFillsTheUnitCube) {
  const Mesh mesh = generate_cube(GetParam(), 1);
  EXPECT_EQ(mesh.node_count(), GetParam());
  expect_valid(mesh);
  expect_all_nodes_used(mesh);
  expect_conforming(mesh, is_on_unit_cube);
  EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 1, 1e-12);
}

TEST(GenerateCube, IsTheSameForTheSameSeedOnly) {
  const Mesh once = generate_cube(500, 1);
  const Mesh again = generate_cube(500, 1);
  const Mesh other = generate_cube(500, 2);
  EXPECT_TRUE(nodes_of(once) == nodes_of(again));
  EXPECT_EQ(once.blocks[0].nodes, again.blocks[0].nodes);
  EXPECT_FALSE(nodes_of(once) == nodes_of(other));
}

// Recorded: other machines and libraries must give these nodes too.
TEST(GenerateCube, HasRecordedNodes) {
  const Mesh mesh = generate_cube(500, 1);
  const Vec3d last = nodes_of(mesh).back();
  EXPECT_EQ(last.x, 0.74240767326719437);
  EXPECT_EQ(last.y, 0.060571324048598774);
  EXPECT_EQ(last.z, 0.13343439488543274);
}

TEST(GenerateCube, HasTheKnownSizeAndQualityOfThePapersMesh) {
  const Mesh mesh = generate_cube(100000, 1);
  EXPECT_EQ(mesh.node_count(), 100000u);
  EXPECT_NEAR(static_cast<double>(mesh.element_count()), 633e3, 3e3);
  const QualityStats quality = measure_quality(mesh);
  EXPECT_EQ(quality.inverted_count, 0);
  EXPECT_EQ(quality.degenerate_count, 0);
  EXPECT_NEAR(quality.metrics[0].mean, 0.625, 0.01);
}

TEST(GenerateSlope, IsAConformingBankWithAnInclinedFace) {
  const Mesh mesh = generate_slope(5000, 1);
  EXPECT_EQ(mesh.node_count(), 5000u);
  expect_valid(mesh);
  expect_all_nodes_used(mesh);
  expect_conforming(mesh, [](Vec3d p) {
    const bool on_slope = std::abs(p.x - 1.5 * p.z) < 1e-12;
    return on_slope || p.x == 4 || p.y == 0 || p.y == 2 || p.z == 0 || p.z == 1;
  });
  EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 6.5, 1e-11);
}

TEST(GenerateCube, IsTangledByAboutTheShareAskedForInsideOnly) {
  const Mesh valid = generate_cube(3000, 1);
  for (const double share : {0.05, 0.3, 0.45}) {
    const Mesh mesh = generate_cube(3000, 1, share);
    const QualityStats quality = measure_quality(mesh);
    EXPECT_NEAR(double(quality.inverted_count) / double(quality.element_count), share, 0.01);
    EXPECT_EQ(mesh.blocks[0].nodes, valid.blocks[0].nodes);
    for (std::size_t node = 0; node < valid.node_count(); ++node) {
      if (is_on_unit_cube(nodes_of(valid)[node])) {
        ASSERT_TRUE(nodes_of(mesh)[node] == nodes_of(valid)[node]);
      }
    }
  }
}

#endif

TEST(GenerateMixed, HasAllVolumeTypesAndFits) {
  for (const std::size_t count : {30u, 300u, 3000u}) {
    const Mesh mesh = generate_mixed(count, 1);
    EXPECT_EQ(mesh.blocks.size(), 4u);
    for (const ElementBlock& block : mesh.blocks) EXPECT_FALSE(block.nodes.empty());
    EXPECT_NEAR(double(mesh.node_count()), double(count), 0.35 * double(count) + 10);
    expect_valid(mesh);
    expect_all_nodes_used(mesh);
    expect_conforming(mesh, is_on_unit_cube);
    EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 1, 1e-12);
  }
}

TEST(GenerateSquare, FillsTheUnitSquare) {
  const Mesh mesh = generate_square(400, 1);
  EXPECT_EQ(mesh.node_count(), 400u);
  expect_valid(mesh);
  EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 1, 1e-12);
  EXPECT_GT(measure_quality(generate_square(400, 1, 0.1)).inverted_count, 0);
}

TEST(GenerateSphere, IsClosedAndOutward) {
  for (const std::size_t count : {6u, 18u, 1000u}) {
    const Mesh mesh = generate_sphere(count, 1, 0.02);
    EXPECT_NEAR(double(mesh.node_count()), double(count), 0.1 * double(count) + 4);
    for (const auto& [edge, uses] : facet_uses(mesh)) ASSERT_EQ(uses, 2);
    EXPECT_EQ(mesh.element_count(), 2 * mesh.node_count() - 4);  // Euler
    const auto& nodes = nodes_of(mesh);
    const auto& corners = mesh.blocks[0].nodes;
    for (std::size_t first = 0; first < corners.size(); first += 3) {
      const Vec3d a = nodes[static_cast<std::size_t>(corners[first])];
      const Vec3d b = nodes[static_cast<std::size_t>(corners[first + 1])];
      const Vec3d c = nodes[static_cast<std::size_t>(corners[first + 2])];
      ASSERT_GT(dot(cross(b - a, c - a), a + b + c), 0);
    }
  }
}

TEST(Generate, RefusesWhatMakesNoMesh) {
  EXPECT_THROW((void)generate_cube(26, 1), InvalidOption);
  EXPECT_THROW((void)generate_cube(1000, 1, 0.9), InvalidOption);
  EXPECT_THROW((void)generate_cube(1000, 1, -0.1), InvalidOption);
  EXPECT_THROW((void)generate_mixed(3, 1), InvalidOption);
  EXPECT_THROW((void)generate_sphere(100, 1, 2), InvalidOption);
}

TEST(GenerateBall, FillsTheSphereWithTetrahedra) {
  const Mesh mesh = generate_ball(3000, 1);
  EXPECT_EQ(mesh.node_count(), 3000U);
  expect_valid(mesh);
  expect_conforming(mesh, [](Vec3d p) { return std::abs(norm(p) - 1) < 1e-12; });
  EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 4.18879, 0.1);
  EXPECT_EQ(nodes_of(mesh), nodes_of(generate_ball(3000, 1)));
}

TEST(GeneratePipe, IsBoundedByTwoCylindersAndTwoPlanes) {
  const Mesh mesh = generate_pipe(3000, 1);
  EXPECT_NEAR(static_cast<double>(mesh.node_count()), 3000, 750);
  expect_valid(mesh);
  expect_conforming(mesh, [](Vec3d p) {
    const double radius = std::hypot(p.x, p.y);
    return std::abs(radius - 0.5) < 1e-12 || std::abs(radius - 1) < 1e-12 || p.z == 0 || p.z == 1;
  });
  EXPECT_NEAR(measure_quality(mesh).sum_absolute_volume, 2.35619, 0.05);
  EXPECT_GT(measure_quality(generate_pipe(3000, 1, 0.2)).inverted_count, 0);
}

}  // namespace
}  // namespace meshsmooth::formats
