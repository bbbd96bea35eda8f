// What a stranger's mesh may cost: numberings and hubs that make a step search anew for each
// element must not cost more than the mesh is larger.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/chain.hpp"
#include "core/growth.hpp"
#include "core/smoothing.hpp"
#include "meshsmooth/method_traits.hpp"

namespace meshsmooth {
namespace {

using test::cone;
using test::cpu_seconds;
using test::kTurn;

/// n triangles about a node; `height` above the others.
Mesh fan(int n, double height = 0) {
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>();
  positions = {{0, 0, height}};
  std::vector<NodeId> triangles;
  for (int i = 0; i < n; ++i) {
    positions.push_back({std::cos(kTurn * i / n), std::sin(kTurn * i / n), 0});
    triangles.insert(triangles.end(), {0, 1 + i, 1 + (i + 1) % n});
  }
  mesh.blocks = {{ElementType::triangle, std::move(triangles)}};
  return mesh;
}

/// n quadrilaterals about a node.
Mesh quad_fan(int n) {
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>();
  positions = {{0, 0, 0}};
  std::vector<NodeId> quads;
  for (int i = 0; i < 2 * n; ++i) {
    const double radius = i % 2 == 0 ? 1 : 1.2;
    positions.push_back(
        {radius * std::cos(kTurn * i / (2 * n)), radius * std::sin(kTurn * i / (2 * n)), 0});
  }
  for (int i = 0; i < n; ++i) {
    quads.insert(quads.end(), {0, 1 + 2 * i, 2 + 2 * i, 1 + (2 * i + 2) % (2 * n)});
  }
  mesh.blocks = {{ElementType::quad, std::move(quads)}};
  return mesh;
}

/// n wedges about an axis.
Mesh wedge_fan(int n) {
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>();
  positions = {{0, 0, 0}, {0, 0, 1}};
  std::vector<NodeId> wedges;
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    for (const double z : {0, 1}) {
      positions.push_back({std::cos(kTurn * i / n), std::sin(kTurn * i / n), z});
    }
    wedges.insert(wedges.end(), {0, 2 + 2 * j, 2 + 2 * i, 1, 3 + 2 * j, 3 + 2 * i});
  }
  mesh.blocks = {{ElementType::wedge, std::move(wedges)}};
  return mesh;
}

/// Of a job of two sweeps.
double cost_of(const Mesh& mesh, SmoothOptions options) {
  options.max_iterations = 2;
  const std::vector<NodeId> moved = {1};
  const std::vector<Vec3d> there = {test::points(mesh)[1]};
  JobInput input;
  if (std::holds_alternative<Move>(options.method)) {
    input.prescribed = {moved, std::span(there)};
  }
  const double before = cpu_seconds();
  test::smooth(mesh, options, input, 1);
  return cpu_seconds() - before;
}

/// The least of several attempts: other programs use the same caches.
template <class MakeMesh>
void expect_linear(const std::string& what, const MakeMesh& make, const SmoothOptions& options) {
  constexpr int kNodes = 8000;
  constexpr double kNoise = 0.01;  // seconds
  constexpr double kMost = 8;      // what is linear misses caches; what is quadratic takes 16
  double one = std::numeric_limits<double>::max(), four = one;
  for (int attempt = 0; attempt == 0 || (attempt < 3 && four > kMost * one); ++attempt) {
    one = std::max(kNoise, std::min(one, cost_of(make(kNodes), options)));
    four = std::min(four, cost_of(make(4 * kNodes), options));
  }
  EXPECT_LE(four, kMost * one) << what << ": seconds of four times as many elements";
}

TEST(Growth, IsLinearForEveryMethodAtAHub) {
  for_each_method([&](const Method& method) {
    const std::string name(method_name(method));
    for (const BoundaryPolicy boundary :
         {BoundaryPolicy::fixed, BoundaryPolicy::slide, BoundaryPolicy::free}) {
      if (std::holds_alternative<Move>(method) && boundary != BoundaryPolicy::fixed) continue;
      const SmoothOptions options{.method = method, .boundary = boundary};
      const std::string policy = name + " " + std::to_string(static_cast<int>(boundary));
      expect_linear(policy + " cone", cone, options);
      expect_linear(
          policy + " fan", [](int n) { return fan(n); }, options);
    }
  });
}

TEST(Growth, IsLinearAtAHubOfACurvedSurface) {
  expect_linear("low tent", [](int n) { return fan(n, 0.1); }, {.method = Optimize{}});
}

TEST(Growth, IsLinearAtHubsOfElementsThatLieInLayers) {
  for (const Method& method : {Method(Optimize{}), Method(SmartLaplacian{}), Method(Laplacian{})}) {
    const SmoothOptions options{.method = method, .boundary = BoundaryPolicy::free};
    const std::string name(method_name(method));
    expect_linear(name + " quadrilaterals", quad_fan, options);
    expect_linear(name + " wedges", wedge_fan, options);
  }
}

TEST(Growth, IsLinearForIdsThatMakeColouringAChain) {
  for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::free}) {
    expect_linear("chain", test::chain,
                  {.method = Laplacian{}, .form = Form::gauss_seidel, .boundary = boundary});
  }
}

}  // namespace
}  // namespace meshsmooth
