// Derivatives of Move's linear prediction: tangents and cotangents.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/derivatives.hpp"
#include "support/second_order.hpp"
#include "support/tilted.hpp"

namespace meshsmooth {
namespace {

using namespace test::derivatives;  // NOLINT(google-build-using-namespace)
using test::jittered_unit_lattice;
using test::points;
using test::tilted;

TEST(Derivative, TangentsAndCotangentsAreTransposesForEveryElement) {
  for (const ElementType type : kLinearTypes) {
    const std::string name(element_name(type));
    const Mesh linear = jittered_unit_lattice(type, 5);
    std::vector<std::pair<std::string, Mesh>> meshes = {
        {name, linear},
        {name + " of second order", test::second_order(linear)},
        {name + " of full second order", test::second_order(linear, true)}};
    for (const auto& [order, mesh] : meshes) {
      expect_transposes(whole_boundary(order, mesh));
      expect_transposes(one_side(order + ", one side", mesh, BoundaryPolicy::fixed));
      expect_transposes(one_side(order + ", sliding", mesh, BoundaryPolicy::slide));
      expect_transposes(one_side(order + ", free", mesh, BoundaryPolicy::free));
    }
  }
  expect_transposes(whole_boundary("mixed", test::noisy(test::mixed_stack(3), 0.1, 2)));
}

TEST(Derivative, AreTransposesWhereNodesSlideObliquely) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    Case of = one_side("tilted " + std::string(element_name(type)), jittered_unit_lattice(type, 6),
                       BoundaryPolicy::slide);
    of.reference = test::mapped(of.reference, tilted);
    expect_transposes(of);
    const Derivatives result = tangent(of, random_vectors(of.nodes.size(), 5));
    EXPECT_GT(result.summary.nodes.sliding_in_plane, 0);
    EXPECT_GT(result.summary.nodes.sliding_on_line, 0);
  }
}

/// A turned mesh has the turned tangents: to the tolerance of planes.
TEST(Derivative, DoNotDependOnTheAxes) {
  Case of =
      one_side("cube", jittered_unit_lattice(ElementType::tetrahedron, 6), BoundaryPolicy::slide);
  Vectors u = random_vectors(of.nodes.size(), 7);
  Vectors expected = tangent(of, u).vectors;
  of.reference = test::mapped(of.reference, tilted);
  for (Vec3d& v : u) v = tilted(v);
  for (Vec3d& v : expected) v = tilted(v);
  EXPECT_LT(largest_difference(tangent(of, u).vectors, expected), 1e-9);
}

/// Without sweeps a motion is the linear prediction, solved to 1e-4.
TEST(Derivative, PredictTheMotionWithoutSweeps) {
  std::vector<Case> cases;
  cases.push_back(whole_boundary("hexahedra", jittered_unit_lattice(ElementType::hexahedron, 6)));
  const Mesh cube = jittered_unit_lattice(ElementType::tetrahedron, 6);
  cases.push_back(one_side("sliding", cube, BoundaryPolicy::slide));
  cases.push_back(one_side("free", cube, BoundaryPolicy::free));
  cases.push_back(one_side("second order", test::second_order(cube), BoundaryPolicy::slide));
  cases.push_back(one_side("sliding obliquely", cube, BoundaryPolicy::slide));
  cases.back().reference = test::mapped(cube, tilted);
  for (const Case& of : cases) {
    SCOPED_TRACE(of.name);
    constexpr double kStep = 1e-3;
    Vectors u = random_vectors(of.nodes.size(), 3);
    Vectors to;
    for (std::size_t n = 0; n < u.size(); ++n) {
      to.push_back(points(of.reference)[static_cast<std::size_t>(of.nodes[n])] + kStep * u[n]);
    }
    SmoothOptions options = options_of(of, Derivative::none);
    options.max_iterations = 0;
    const Derivatives moved =
        run(of, options, {.prescribed = {of.nodes, std::span<const Vec3d>(to)}});
    ASSERT_EQ(moved.summary.motion->reached, 1);
    Vectors difference = moved.vectors;
    for (std::size_t n = 0; n < difference.size(); ++n) {
      difference[n] = (1 / kStep) * (difference[n] - points(of.reference)[n]);
    }
    EXPECT_LT(largest_difference(difference, tangent(of, u).vectors), 2e-3);
  }
}

/// Linear finite elements have the linear functions, which solve Laplace's equation.
TEST(Derivative, ContinueAnAffineMotionExactly) {
  for (const bool second_order : {false, true}) {
    Mesh mesh = jittered_unit_lattice(ElementType::tetrahedron, 8);
    if (second_order) mesh = test::second_order(mesh);
    const Case of = whole_boundary("affine", std::move(mesh));
    const auto affine = [](Vec3d p) {
      return Vec3d{0.3 * p.z - p.y, 2 * p.x + 1, p.x + p.y - 4 * p.z};
    };
    Vectors expected;
    for (const Vec3d p : points(of.reference)) expected.push_back(affine(p));
    EXPECT_LT(largest_difference(tangent(of, at(of.nodes, expected)).vectors, expected), 1e-11);
  }
}

/// The columns of the matrix, one by one.
TEST(Derivative, CotangentsAreTheRowsOfTheMatrix) {
  const Case of =
      one_side("square", jittered_unit_lattice(ElementType::quad, 3), BoundaryPolicy::slide);
  const std::size_t count = of.reference.node_count();
  for (std::size_t row = 0; row < count; ++row) {
    Vectors w(count);
    w[row] = {0, 1, 0};
    const Vectors reverse = at(of.nodes, cotangent(of, w).vectors);
    for (std::size_t n = 0; n < of.nodes.size(); ++n) {
      Vectors u(of.nodes.size());
      u[n] = {0, 1, 0};
      EXPECT_NEAR(tangent(of, u).vectors[row].y, reverse[n].y, 1e-12);
    }
  }
}

TEST(Derivative, HaveTheSameBitsWithAnyNumberOfThreads) {
  const Case of =
      one_side("cube", jittered_unit_lattice(ElementType::tetrahedron, 9), BoundaryPolicy::slide);
  const Vectors u = random_vectors(of.nodes.size(), 3);
  const Vectors w = random_vectors(of.reference.node_count(), 4);
  EXPECT_EQ(tangent(of, u, {"cpu", 1}).vectors, tangent(of, u, {"cpu", 4}).vectors);
  EXPECT_EQ(cotangent(of, w, {"cpu", 1}).vectors, cotangent(of, w, {"cpu", 4}).vectors);
}

/// By multigrid: the same solution in few iterations.
TEST(Derivative, ShareTheSystemOfAKeptReference) {
  const Case of =
      one_side("cube", jittered_unit_lattice(ElementType::tetrahedron, 20), BoundaryPolicy::slide);
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(of.reference);
  const auto prepared = smoother->prepare(topology.view(), {}, of.reference.positions_view());
  const Vectors u = random_vectors(of.nodes.size(), 1);
  const Vectors w = random_vectors(of.reference.node_count(), 2);
  const auto on_kept = [&](Derivative derivative, const JobInput& input) {
    Derivatives result{Vectors(w.size()), {}};
    JobPositions arrays(of.reference.positions_view(), std::span(result.vectors));
    arrays.input = input;
    result.summary = smoother->smooth(*prepared, arrays, options_of(of, derivative), {});
    EXPECT_LE(result.summary.motion->linear_residual, 1e-13);
    EXPECT_LE(result.summary.motion->linear_iteration_count, 80);
    return result.vectors;
  };
  const Vectors forward =
      on_kept(Derivative::tangent, {.prescribed = {of.nodes, std::span<const Vec3d>(u)}});
  const Vectors reverse = on_kept(Derivative::cotangent, {.prescribed = {of.nodes, {}},
                                                          .cotangent = std::span<const Vec3d>(w)});
  EXPECT_LT(largest_difference(forward, tangent(of, u).vectors), 1e-11);
  EXPECT_LT(largest_difference(reverse, cotangent(of, w).vectors), 1e-11);
}

/// Laplace's matrix is singular on a part of the mesh that nothing holds.
TEST(Derivative, AreZeroOnPartsThatNothingHolds) {
  Mesh mesh = jittered_unit_lattice(ElementType::tetrahedron, 4);
  const std::size_t count = mesh.node_count();
  Vectors& all = points(mesh);
  for (std::size_t n = 0; n < count; ++n) all.push_back(all[n] + Vec3d{5, 5, 5});
  std::vector<NodeId>& nodes = mesh.blocks.front().nodes;
  const std::size_t entries = nodes.size();
  for (std::size_t n = 0; n < entries; ++n) {
    nodes.push_back(nodes[n] + static_cast<NodeId>(count));
  }
  const Case of = one_side("two cubes", std::move(mesh), BoundaryPolicy::free);
  expect_transposes(of);
  const Vectors forward = tangent(of, random_vectors(of.nodes.size(), 1)).vectors;
  for (std::size_t n = count; n < forward.size(); ++n) EXPECT_EQ(norm(forward[n]), 0);
}

TEST(Derivative, OfFloatsAreThoseOfDoubles) {
  const Case of =
      one_side("cube", jittered_unit_lattice(ElementType::hexahedron, 6), BoundaryPolicy::slide);
  const Vectors u = random_vectors(of.nodes.size(), 1);
  std::vector<Vec3f> reference, result(of.reference.node_count());
  for (const Vec3d p : points(of.reference)) reference.push_back(vec3_cast<float>(p));
  const MeshTopology topology(of.reference);
  const PositionsView given = std::span<const Vec3f>(reference);
  JobPositions arrays(given, std::span(result));
  arrays.input.prescribed = {of.nodes, std::span<const Vec3d>(u)};
  make_smoother("cpu", 2)->smooth(topology.view(), arrays, options_of(of, Derivative::tangent), {});
  Vectors widened;
  for (const Vec3f v : result) widened.push_back(vec3_cast<double>(v));
  EXPECT_LT(largest_difference(widened, tangent(of, u).vectors), 1e-4);
}

TEST(Derivative, LeaveTheMeshAsItIs) {
  const Case of = whole_boundary("square", jittered_unit_lattice(ElementType::triangle, 6));
  const SmoothSummary summary = tangent(of, random_vectors(of.nodes.size(), 1)).summary;
  EXPECT_EQ(summary.nodes.moved, 0);
  EXPECT_EQ(summary.quality_after.inverted_count, 0);
  EXPECT_EQ(summary.quality_after.metrics.front().min, summary.quality_before.metrics.front().min);
  EXPECT_EQ(summary.convergence.iteration_count, 0);
}

std::string refusal(const Case& of, const SmoothOptions& options, const JobInput& input) {
  try {
    run(of, options, input);
  } catch (const Error& error) {
    return std::string(error.reason());
  }
  return "none";
}

TEST(Derivative, RefuseBadInputByName) {
  for (const bool second_order : {false, true}) {
    Mesh mesh = jittered_unit_lattice(ElementType::tetrahedron, 3);
    if (second_order) mesh = test::second_order(mesh);
    const Case of = one_side("cube", std::move(mesh), BoundaryPolicy::slide);
    const SmoothOptions forward = options_of(of, Derivative::tangent);
    const SmoothOptions reverse = options_of(of, Derivative::cotangent);
    const auto of_tangents = [&](const auto& change) {
      std::vector<NodeId> nodes = of.nodes;
      Vectors u = random_vectors(nodes.size(), 1);
      change(nodes, u);
      return refusal(of, forward, {.prescribed = {nodes, std::span<const Vec3d>(u)}});
    };
    EXPECT_EQ(of_tangents([](auto&, Vectors& u) { u.pop_back(); }), "ARRAY_SIZE_MISMATCH");
    EXPECT_EQ(of_tangents([](auto&, Vectors& u) { u[2].x = NAN; }), "NON_FINITE_COORDINATE");
    EXPECT_EQ(of_tangents([](auto& nodes, Vectors& u) { nodes.clear(), u.clear(); }),
              "OPTION_OUT_OF_RANGE");
    EXPECT_EQ(of_tangents([](auto& nodes, Vectors&) { nodes[1] = nodes[0]; }), "PRESCRIBED_TWICE");
    const auto of_cotangents = [&](const auto& change) {
      std::vector<NodeId> nodes = of.nodes;
      Vectors w = random_vectors(of.reference.node_count(), 1);
      change(nodes, w);
      return refusal(of, reverse,
                     {.prescribed = {nodes, {}}, .cotangent = std::span<const Vec3d>(w)});
    };
    EXPECT_EQ(of_cotangents([](auto&, Vectors&) {}), "none");
    EXPECT_EQ(of_cotangents([](auto&, Vectors& w) { w.pop_back(); }), "ARRAY_SIZE_MISMATCH");
    EXPECT_EQ(of_cotangents([](auto&, Vectors& w) { w.clear(); }), "ARRAY_SIZE_MISMATCH");
    EXPECT_EQ(of_cotangents([](auto&, Vectors& w) { w[7].z = INFINITY; }), "NON_FINITE_COORDINATE");
    EXPECT_EQ(of_cotangents([](auto& nodes, Vectors&) { nodes.clear(); }), "OPTION_OUT_OF_RANGE");
    EXPECT_EQ(of_cotangents([](auto& nodes, Vectors&) { nodes[0] = -1; }), "INDEX_OUT_OF_RANGE");

    const Vectors u = random_vectors(of.nodes.size(), 1);
    const Vectors w = random_vectors(of.reference.node_count(), 1);
    const JobInput both{.prescribed = {of.nodes, std::span<const Vec3d>(u)},
                        .cotangent = std::span<const Vec3d>(w)};
    EXPECT_EQ(refusal(of, forward, both), "OPTION_NOT_SUPPORTED");
    EXPECT_EQ(refusal(of, reverse, both), "OPTION_NOT_SUPPORTED");
    const auto with = [&](const auto& change) {
      SmoothOptions options = forward;
      change(options);
      return refusal(of, options, {.prescribed = {of.nodes, std::span<const Vec3d>(u)}});
    };
    EXPECT_EQ(with([](SmoothOptions& o) { o.movement_limit = MovementLimit{1}; }),
              "OPTION_NOT_SUPPORTED");
    EXPECT_EQ(with([](SmoothOptions& o) { o.report_below = 0.5; }), "OPTION_NOT_SUPPORTED");
    EXPECT_EQ(
        with([](SmoothOptions& o) { o.element_quality_metrics = {QualityMetric::mean_ratio}; }),
        "OPTION_NOT_SUPPORTED");
    EXPECT_EQ(with([](SmoothOptions& o) { std::get<Move>(o.method).start = Start::warm; }),
              "OPTION_NOT_SUPPORTED");
  }
}

}  // namespace
}  // namespace meshsmooth
