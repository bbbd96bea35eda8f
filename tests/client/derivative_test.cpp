// Derivatives of motions through the service, in chunks and by shared memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "meshsmooth/client.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"
#include "support/both_ways.hpp"
#include "support/tilted.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth::client {
namespace {

using Vectors = std::vector<Vec3d>;

class Derivatives : public testing::BothWays {
 protected:
  Derivatives() {
    for (std::size_t n = 0; n < mesh_.node_count(); ++n) {
      const Vec3d p = test::points(mesh_)[n];
      if (p.z < 1e-9) {
        nodes_.push_back(static_cast<NodeId>(n));
        tangents_.push_back({std::sin(5 * p.x), p.y, p.x * p.y});
      }
      cotangents_.push_back({p.y, std::cos(4 * p.z), p.x - p.z});
    }
    options_.boundary = BoundaryPolicy::slide;
  }

  /// As without a server.
  [[nodiscard]] Vectors expected(Derivative derivative, const JobInput& input) const {
    SmoothOptions options = options_;
    std::get<Move>(options.method).derivative = derivative;
    Vectors result(mesh_.node_count());
    const MeshTopology topology(mesh_);
    JobPositions arrays(mesh_.positions_view(), std::span(result));
    arrays.input = input;
    make_smoother("cpu")->smooth(topology.view(), arrays, options, {});
    return result;
  }

  const Mesh mesh_ = test::jittered_unit_lattice(ElementType::tetrahedron, 14);
  std::vector<NodeId> nodes_;
  Vectors tangents_, cotangents_;
  SmoothOptions options_{.method = Move{}};
};

INSTANTIATE_TEST_SUITE_P(Ways, Derivatives, ::testing::Bool(), testing::way_name);

double largest_difference(const Vectors& a, const Vectors& b) {
  double largest = a.size() == b.size() ? 0 : HUGE_VAL;
  for (std::size_t n = 0; n < std::min(a.size(), b.size()); ++n) {
    largest = std::max(largest, norm(a[n] - b[n]));
  }
  return largest;
}

TEST_P(Derivatives, AreThoseWithoutAServer) {
  Client client(target());
  Session session = client.open(mesh_);
  const Vectors forward =
      expected(Derivative::tangent, {.prescribed = {nodes_, std::span<const Vec3d>(tangents_)}});
  const Vectors all =
      expected(Derivative::cotangent,
               {.prescribed = {nodes_, {}}, .cotangent = std::span<const Vec3d>(cotangents_)});
  Vectors reverse;
  for (const NodeId node : nodes_) reverse.push_back(all[static_cast<std::size_t>(node)]);
  EXPECT_TRUE(goes_its_way([&] {
    const MotionDerivative result =
        session.move_tangent(nodes_, std::span<const Vec3d>(tangents_), options_, request());
    EXPECT_LT(largest_difference(std::get<Vectors>(result.vectors), forward), 1e-11);
    EXPECT_LE(result.report.summary.motion.value().linear_residual, 1e-13);
    return result.report;
  }));
  EXPECT_TRUE(goes_its_way([&] {
    const MotionDerivative result =
        session.move_transpose(nodes_, std::span<const Vec3d>(cotangents_), options_, request());
    EXPECT_LT(largest_difference(std::get<Vectors>(result.vectors), reverse), 1e-11);
    return result.report;
  }));
}

TEST_P(Derivatives, LeaveThePositionsOfASession) {
  Client client(target());
  Session session = client.open(mesh_);
  Vectors to;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const auto node = static_cast<std::size_t>(nodes_[n]);
    to.push_back(test::points(mesh_)[node] + 0.01 * tangents_[n]);
  }
  for (int step = 0; step < 3; ++step) {
    (void)session.move(nodes_, std::span<const Vec3d>(to), options_, request());
    const auto moved = std::get<std::span<const Vec3d>>(session.positions());
    const Vectors before(moved.begin(), moved.end());
    (void)session.move_transpose(nodes_, std::span<const Vec3d>(cotangents_), options_, request());
    const auto now = std::get<std::span<const Vec3d>>(session.positions());
    EXPECT_EQ(Vectors(now.begin(), now.end()), before);
  }
}

TEST_P(Derivatives, RefuseBadInputBeforeItTravels) {
  Client client(target());
  Session session = client.open(mesh_);
  const auto reason = [&](const auto& job) -> std::string {
    try {
      job();
    } catch (const Error& error) {
      return std::string(error.reason());
    }
    return "none";
  };
  const std::span<const Vec3d> few = std::span(cotangents_).first(7);
  EXPECT_EQ(reason([&] { (void)session.move_transpose(nodes_, few, options_); }),
            "ARRAY_SIZE_MISMATCH");
  EXPECT_EQ(reason([&] { (void)session.move_tangent(nodes_, few, options_); }),
            "ARRAY_SIZE_MISMATCH");
  Vectors infinite = cotangents_;
  infinite[3].y = INFINITY;
  EXPECT_EQ(reason([&] {
              (void)session.move_transpose(nodes_, std::span<const Vec3d>(infinite), options_);
            }),
            "NON_FINITE_COORDINATE");
  EXPECT_EQ(reason([&] {
              (void)session.move_transpose({}, std::span<const Vec3d>(cotangents_), options_);
            }),
            "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason([&] {
              (void)session.move_tangent(nodes_, std::span<const Vec3d>(tangents_),
                                         {.method = Laplacian{}});
            }),
            "OPTION_NOT_SUPPORTED");
}

/// A reference in another precision would be converted where the cotangents lie.
TEST(DerivativeLayout, HasCotangentsInTheTypeOfTheReference) {
  wire::MeshLayout layout{.node_count = 8, .blocks = {}, .coordinates_bytes = 8 * sizeof(Vec3d)};
  layout.kept_reference_float64 = true;
  layout.expect_prescribed(3, {}, true);
  const auto arrays = layout.arrays();
  ASSERT_EQ(arrays.size(), 2U);
  EXPECT_EQ(arrays[0].id, v1::ARRAY_ID_COORDINATES);
  EXPECT_EQ(arrays[1].id, v1::ARRAY_ID_PRESCRIBED_NODES);

  wire::MeshLayout other{.node_count = 8, .blocks = {}, .coordinates_bytes = 8 * sizeof(Vec3d)};
  other.kept_reference_float64 = false;
  EXPECT_THROW(other.expect_prescribed(3, {}, true), NotSupported);
  other.expect_prescribed(3, {}, false);
  EXPECT_FALSE(other.coordinates_follow);
}

}  // namespace
}  // namespace meshsmooth::client
