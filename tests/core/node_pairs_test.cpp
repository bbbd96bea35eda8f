#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/meshes.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using ::testing::HasSubstr;

const std::vector<Vec3d>& points(const Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}

struct Periodic {
  Mesh mesh;
  std::vector<NodePair> pairs;  // of the sides x = 0 and x = its largest
};

/// A lattice with noise inside, curved about the z axis by `angle` from one side to the other; 0:
/// it is straight.
Periodic periodic_lattice(ElementType type, double angle) {
  const Mesh regular = test::lattice(linear_type(type), 4);
  Periodic result{test::noisy(regular, 0.1, 5), {}};
  double last = 0;
  for (const Vec3d& p : points(regular)) last = std::max(last, p.x);
  for (std::size_t n = 0; n < regular.node_count(); ++n) {
    const Vec3d at = points(regular)[n];
    if (at.x == 0 || at.x == last) std::get<std::vector<Vec3d>>(result.mesh.positions)[n] = at;
  }
  if (is_second_order(type)) {
    const Mesh plain = test::second_order(result.mesh, false);
    result.mesh = plain.blocks[0].type == type ? plain : test::second_order(result.mesh, true);
  }
  auto& all = std::get<std::vector<Vec3d>>(result.mesh.positions);
  for (std::size_t a = 0; a < all.size(); ++a) {
    for (std::size_t b = 0; b < all.size(); ++b) {
      const Vec3d from = all[a], to = all[b];
      if (from.x != 0 || to.x != last || from.y != to.y || from.z != to.z) continue;
      result.pairs.push_back({static_cast<NodeId>(a), static_cast<NodeId>(b)});
    }
  }
  for (Vec3d& p : all) {
    const double turn = angle * p.x / last;
    const double radius = last + p.y;
    if (angle != 0) p = {radius * std::sin(turn), radius * std::cos(turn), p.z};
  }
  return result;
}

/// How far the nodes of pairs are from where the turn by `angle`, or the translation, has them.
double farthest_apart(const Periodic& periodic, double angle) {
  const double sine = std::sin(angle), cosine = std::cos(angle);
  const auto partner_of = [&](Vec3d p) {
    return Vec3d{cosine * p.x + sine * p.y, cosine * p.y - sine * p.x, p.z};
  };
  const auto at = [&](NodeId node) {
    return points(periodic.mesh)[static_cast<std::size_t>(node)];
  };
  const auto [first_a, first_b] = periodic.pairs.front();
  const Vec3d shift = angle == 0 ? at(first_b) - at(first_a) : Vec3d{0, 0, 0};
  double farthest = 0;
  for (const auto& [a, b] : periodic.pairs) {
    farthest = std::max(farthest, norm(at(b) - (partner_of(at(a)) + shift)));
  }
  return farthest;
}

class NodePairs : public ::testing::TestWithParam<ElementType> {};

INSTANTIATE_TEST_SUITE_P(AllTypes, NodePairs, ::testing::ValuesIn(kElementTypes),
                         [](const auto& type) { return std::string(element_name(type.param)); });

TEST_P(NodePairs, StayMatchedByEveryMethodUnderEveryBoundary) {
  for (const double angle : {0.0, 0.7}) {
    const Periodic periodic = periodic_lattice(GetParam(), angle);
    for (const test::Way& way : test::ways(false)) {
      for (const BoundaryPolicy boundary :
           {BoundaryPolicy::fixed, BoundaryPolicy::slide, BoundaryPolicy::free}) {
        const bool optimizes = std::holds_alternative<Optimize>(way.method);
        if (optimizes && boundary == BoundaryPolicy::free) continue;
        const test::Job job = test::smooth(periodic.mesh,
                                           {.method = way.method,
                                            .form = way.form,
                                            .max_iterations = 3,
                                            .boundary = boundary,
                                            .never_worse = false},
                                           {.node_pairs = periodic.pairs});
        for (std::size_t i = 0; i < periodic.pairs.size(); ++i) {
          for (const NodeId node : periodic.pairs[i]) {
            const auto n = static_cast<std::size_t>(node);
            EXPECT_EQ(points(job.mesh)[n], points(periodic.mesh)[n]) << way.name;
          }
        }
        EXPECT_EQ(job.summary.nodes.paired, static_cast<std::int64_t>(2 * periodic.pairs.size()));
        // Of second order, corners of curved edges stay where they would slide; here all are.
        if (angle == 0 || boundary == BoundaryPolicy::fixed || !is_second_order(GetParam())) {
          EXPECT_GT(job.summary.nodes.moved, 0) << way.name;
        }
      }
    }
  }
}

TEST_P(NodePairs, StayMatchedOverAHundredMotions) {
  for (const double angle : {0.0, 0.7}) {
    Periodic periodic = periodic_lattice(GetParam(), angle);
    const auto smoother = make_smoother("cpu", 2);
    for (int step = 0; step < 100; ++step) {
      // Half of the pairs travel, away from the axis, the others are held.
      std::vector<NodeId> nodes;
      std::vector<Vec3d> to;
      const double way = 0.002 * std::sin(0.3 * step);
      for (std::size_t i = 0; i < periodic.pairs.size(); i += 2) {
        for (const int side : {0, 1}) {
          const NodeId node = periodic.pairs[i][static_cast<std::size_t>(side)];
          const double turn = side * angle;
          nodes.push_back(node);
          to.push_back(points(periodic.mesh)[static_cast<std::size_t>(node)] +
                       way * Vec3d{std::sin(turn), std::cos(turn), 0});
        }
      }
      const JobInput input{.prescribed = {nodes, std::span<const Vec3d>(to)},
                           .node_pairs = periodic.pairs};
      const SmoothSummary summary = smoother->smooth(periodic.mesh, {.method = Move{}}, {}, input);
      ASSERT_EQ(summary.motion->reached, 1) << step;
      ASSERT_EQ(summary.nodes.paired,
                static_cast<std::int64_t>(2 * periodic.pairs.size() - nodes.size()));
    }
    EXPECT_LE(farthest_apart(periodic, angle), angle == 0 ? 0 : 1e-13);
  }
}

TEST_P(NodePairs, OfAJobOnAPreparedTopologyAreHeldToo) {
  const Periodic periodic = periodic_lattice(GetParam(), 0);
  const SmoothOptions options{.boundary = BoundaryPolicy::slide};
  const test::Job expected = test::smooth(periodic.mesh, options, {.node_pairs = periodic.pairs});
  Mesh mesh = periodic.mesh;
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(periodic.mesh);
  const auto prepared = smoother->prepare(topology.view());
  JobPositions arrays(mesh.positions_span());
  arrays.input.node_pairs = periodic.pairs;
  const SmoothSummary summary = smoother->smooth(*prepared, arrays, options, {});
  EXPECT_TRUE(test::same_bits(mesh, expected.mesh));
  EXPECT_EQ(summary.nodes.paired, expected.summary.nodes.paired);
}

TEST(NodePair, OfNodesThatDoNotExistIsRefused) {
  const Periodic periodic = periodic_lattice(ElementType::tetrahedron, 0);
  for (const NodeId wrong : {-1, 1000000}) {
    const std::vector<NodePair> pairs = {{0, 1}, {0, wrong}};
    try {
      test::smooth(periodic.mesh, {}, {.node_pairs = pairs});
      FAIL() << wrong;
    } catch (const InvalidMesh& error) {
      EXPECT_EQ(error.reason(), "INDEX_OUT_OF_RANGE");
      EXPECT_THAT(error.what(), HasSubstr("node pair 1: node " + std::to_string(wrong)));
    }
  }
}

TEST(NodePair, OfWhichOneNodeIsPrescribedIsRefused) {
  const Periodic periodic = periodic_lattice(ElementType::tetrahedron, 0);
  const auto [a, b] = periodic.pairs[2];
  for (const NodeId node : {a, b}) {
    const std::vector<NodeId> nodes = {node};
    const std::vector<Vec3d> to = {points(periodic.mesh)[static_cast<std::size_t>(node)]};
    try {
      test::smooth(
          periodic.mesh, {.method = Move{}},
          {.prescribed = {nodes, std::span<const Vec3d>(to)}, .node_pairs = periodic.pairs});
      FAIL() << node;
    } catch (const InvalidMesh& error) {
      EXPECT_EQ(error.reason(), "PAIR_HALF_PRESCRIBED");
      EXPECT_THAT(error.what(), HasSubstr("node " + std::to_string(node) + " is prescribed"));
    }
  }
}

TEST(NodePair, IsCountedInTheEstimate) {
  const auto smoother = make_smoother("cpu", 1);
  MeshSize size{.node_count = 1000};
  size.element_counts[static_cast<std::size_t>(ElementType::tetrahedron)] = 5000;
  const std::int64_t without = smoother->estimate(size, {}).host_bytes;
  size.node_pairs = true;
  EXPECT_EQ(smoother->estimate(size, {}).host_bytes, without + 1000);
}

}  // namespace
}  // namespace meshsmooth
