// Pairs of nodes on their way from the client library to a smoother and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/client.hpp"
#include "meshsmooth/smoother.hpp"
#include "support/both_ways.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using Points = std::vector<Vec3d>;

/// A cube that is shaken inside, large enough to travel through shared memory; its sides x = 0 and
/// x = last are periodic.
struct PeriodicCube {
  Mesh mesh;
  std::vector<NodePair> pairs;
  double width = 0;
};

PeriodicCube periodic_cube() {
  const Mesh regular = test::lattice(ElementType::tetrahedron, 16);
  PeriodicCube cube{test::noisy(regular, 0.1, 5), {}};
  const Points& plain = test::points(regular);
  for (const Vec3d& p : plain) cube.width = std::max(cube.width, p.x);
  std::map<std::pair<double, double>, NodePair> by_place;
  for (std::size_t n = 0; n < plain.size(); ++n) {
    const auto& [x, y, z] = plain[n];
    if (x != 0 && x != cube.width) continue;
    auto& [a, b] = by_place[{y, z}];
    (x == 0 ? a : b) = static_cast<NodeId>(n);
  }
  for (const auto& [place, pair] : by_place) cube.pairs.push_back(pair);
  return cube;
}

/// With a sliding boundary, on which the sides part without pairs.
SmoothOptions sliding() {
  SmoothOptions options;
  options.max_iterations = 2;
  options.boundary = BoundaryPolicy::slide;
  options.never_worse = false;
  return options;
}
JobInput pairs_of(const PeriodicCube& cube) {
  JobInput input;
  input.node_pairs = cube.pairs;
  return input;
}

double farthest_apart(const PeriodicCube& cube, const Points& points) {
  double farthest = 0;
  for (const auto& [a, b] : cube.pairs) {
    const Vec3d shift = points[static_cast<std::size_t>(b)] - points[static_cast<std::size_t>(a)];
    farthest = std::max(farthest, norm(shift - Vec3d{cube.width, 0, 0}));
  }
  return farthest;
}

class NodePairs : public testing::BothWays {
 protected:
  const PeriodicCube cube_ = periodic_cube();
};

INSTANTIATE_TEST_SUITE_P(Ways, NodePairs, ::testing::Bool(), testing::way_name);

TEST_P(NodePairs, StayMatchedInAJob) {
  Client client(target());
  const SmoothOptions options = sliding();
  Mesh here = cube_.mesh;
  (void)make_smoother("cpu")->smooth(here, options, {}, pairs_of(cube_));
  EXPECT_TRUE(goes_its_way([&] {
    Mesh mesh = cube_.mesh;
    const SmoothReport report = client.smooth(mesh, options, request(), pairs_of(cube_));
    EXPECT_EQ(farthest_apart(cube_, test::points(mesh)), 0);
    EXPECT_EQ(report.summary.nodes.paired, static_cast<std::int64_t>(2 * cube_.pairs.size()));
    EXPECT_GT(report.summary.nodes.moved, 0);
    EXPECT_EQ(mesh.positions, here.positions) << "as without a server";
    return report;
  }));
  Mesh apart = cube_.mesh;
  (void)client.smooth(apart, sliding(), request());
  EXPECT_GT(farthest_apart(cube_, test::points(apart)), 1e-3) << "they would part";
}

TEST_P(NodePairs, StayMatchedInTheStepsOfASession) {
  Client client(target());
  Session session = client.open(cube_.mesh);
  Points points = test::points(cube_.mesh);
  EXPECT_TRUE(goes_its_way([&] {
    const SmoothReport report = session.smooth(points, sliding(), request(), pairs_of(cube_));
    EXPECT_EQ(farthest_apart(cube_, points), 0);
    EXPECT_EQ(report.summary.nodes.paired, static_cast<std::int64_t>(2 * cube_.pairs.size()));
    return report;
  }));
  points = test::points(cube_.mesh);  // the pairs are of one step
  (void)session.smooth(points, sliding(), request());
  EXPECT_GT(farthest_apart(cube_, points), 1e-3);
}

TEST_P(NodePairs, StayMatchedInTheMotionsOfASession) {
  Client client(target());
  Session session = client.open(cube_.mesh);
  const auto [a, b] = cube_.pairs[cube_.pairs.size() / 2];
  const std::vector<NodeId> nodes = {a, b};
  SmoothOptions options;
  options.method = Move{};
  EXPECT_TRUE(goes_its_way([&] {
    Points to;
    for (const NodeId node : nodes) {
      to.push_back(test::points(cube_.mesh)[static_cast<std::size_t>(node)] + Vec3d{0.1, 0.2, 0});
    }
    const SmoothReport report =
        session.move(nodes, std::span<const Vec3d>(to), options, request(), pairs_of(cube_));
    const auto moved = std::get<std::span<const Vec3d>>(session.positions());
    EXPECT_LT(farthest_apart(cube_, Points(moved.begin(), moved.end())), 1e-12);
    EXPECT_EQ(moved[static_cast<std::size_t>(a)], to[0]);
    return report;
  }));
  try {
    const Points to = {test::points(cube_.mesh)[static_cast<std::size_t>(a)]};
    (void)session.move(std::span(nodes).first(1), std::span<const Vec3d>(to), options, request(),
                       pairs_of(cube_));
    ADD_FAILURE() << "half a pair is prescribed";
  } catch (const Error& error) {
    EXPECT_EQ(error.reason(), "PAIR_HALF_PRESCRIBED");
  }
}

}  // namespace
}  // namespace meshsmooth::client
