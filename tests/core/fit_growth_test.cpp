// What a stranger's target surface may cost: corners, curves and distances that make each node
// search all of it must not cost more than mesh and surface are larger.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/fit_cases.hpp"
#include "core/growth.hpp"
#include "core/smoothing.hpp"
#include "surface/assign.hpp"

namespace meshsmooth {
namespace {

using test::cone;
using test::cpu_seconds;
using test::kTurn;

struct Given {
  Mesh mesh;
  SurfaceMesh surface;
};

/// Of finding a place for all nodes, and of measuring their distances: how many steps bring nodes
/// there depends on the mesh.
double cost_of(const Given& given) {
  SmoothOptions options = test::sliding();
  options.max_iterations = 0;
  const double before = cpu_seconds();
  test::smooth(given.mesh, options, test::on(given.surface), 1);
  return cpu_seconds() - before;
}

/// The least of several attempts: other programs use the same caches.
void expect_linear(const std::string& what, int n, const std::function<Given(int)>& make) {
  constexpr double kNoise = 0.02;  // seconds
  constexpr double kMost = 11;     // what is linear misses caches; what is quadratic takes 16
  double one = std::numeric_limits<double>::max(), four = one;
  for (int attempt = 0; attempt == 0 || (attempt < 3 && four > kMost * one); ++attempt) {
    one = std::max(kNoise, std::min(one, cost_of(make(n))));
    four = std::min(four, cost_of(make(4 * n)));
  }
  std::printf("%s: %.3f s, four times as much %.3f s\n", what.c_str(), one, four);
  EXPECT_LE(four, kMost * one) << what << ": seconds of four times as much";
}

/// A plate with n x n squares on each of two sides.
Mesh plate(int n) {
  const test::Cells cells(ElementType::hexahedron, n,
                          [](int, int, int z) { return z == 0 ? 0 : test::Cells::kNone; });
  Mesh mesh = cells.mesh();
  mesh.regions.clear();
  for (Vec3d& p : test::points(mesh)) p = {p.x / n, p.y / n, p.z / n};
  return mesh;
}

int side_of(int n) { return static_cast<int>(std::sqrt(n)); }

/// Triangles that touch nowhere: three corners and curves each.
SurfaceMesh confetti(int n) {
  SurfaceMesh surface;
  for (int i = 0; i < n; ++i) {
    const double x = std::fmod(i * 0.754877666, 1.0), y = std::fmod(i * 0.569840296, 1.0);
    for (int k = 0; k < 3; ++k) {
      surface.points.push_back({x + 0.01 * std::cos(kTurn * k / 3),
                                y + 0.01 * std::sin(kTurn * k / 3), 0.001 * (i % 7)});
    }
    surface.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return surface;
}

/// Discs whose borders are loops without corners.
SurfaceMesh discs(int n) {
  constexpr int kSides = 12;
  SurfaceMesh surface;
  for (int i = 0; i < n; ++i) {
    const double x = std::fmod(i * 0.754877666, 1.0), y = std::fmod(i * 0.569840296, 1.0);
    const int first = static_cast<int>(surface.points.size());
    surface.points.push_back({x, y, 0.001 * (i % 7)});
    for (int k = 0; k < kSides; ++k) {
      surface.points.push_back({x + 0.1 * std::cos(kTurn * k / kSides),
                                y + 0.1 * std::sin(kTurn * k / kSides), 0.001 * (i % 7)});
      surface.triangles.push_back({first, first + 1 + k, first + 1 + (k + 1) % kSides});
    }
  }
  return surface;
}

/// A pyramid with n folded sides about its apex.
SurfaceMesh folded_cone(int n) {
  SurfaceMesh surface;
  surface.points = {{0, 0, 0}, {0, 0, 1}};
  for (int i = 0; i < n; ++i) {
    const double radius = i % 2 == 0 ? 1 : 0.2;
    surface.points.push_back(
        {radius * std::cos(kTurn * i / n), radius * std::sin(kTurn * i / n), 1});
  }
  for (int i = 0; i < n; ++i) {
    surface.triangles.push_back({0, 2 + i, 2 + (i + 1) % n});
    surface.triangles.push_back({1, 2 + (i + 1) % n, 2 + i});
  }
  return surface;
}

TEST(FitGrowth, IsLinearInCornersAndCurvesWithoutAPlace) {
  expect_linear("confetti", 2000, [](int n) { return Given{plate(side_of(n)), confetti(n)}; });
  expect_linear("discs", 1000, [](int n) { return Given{plate(side_of(n)), discs(n)}; });
}

TEST(FitGrowth, IsLinearAtTheCentreOfASphere) {
  expect_linear("centre", 1600, [](int n) {
    Mesh mesh = plate(side_of(n));
    for (Vec3d& p : test::points(mesh)) p = 1e-6 * (p - Vec3d{0.5, 0.5, 0});
    return Given{std::move(mesh), test::sphere_surface(side_of(n), 1)};
  });
}

TEST(FitGrowth, IsLinearAtAHub) {
  expect_linear("folded cone", 3000, [](int n) { return Given{cone(n), folded_cone(n)}; });
}

/// n x n squares.
detail::BoundaryMesh sheet(int n, const std::function<void()>& check) {
  std::vector<Vec3d> points;
  std::vector<detail::BoundaryFacet> facets;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) points.push_back({1.0 * x / n, 1.0 * y / n, 0});
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const int at = y * (n + 1) + x;
      facets.push_back({at, at + 1, at + n + 2, at + n + 1});
    }
  }
  return {std::move(points), std::move(facets), 30, check};
}

/// The host's work between two chances to cancel a job.
TEST(FitGrowth, ChecksForTheEndOftenEnough) {
  double last = 0, longest = 0;
  const std::function<void()> check = [&] {
    const double now = cpu_seconds();
    longest = std::max(longest, now - last);
    last = now;
  };
  const SurfaceMesh sphere = test::sphere_surface(200, 1);
  last = cpu_seconds();
  const TargetSurface large(sphere, 30, {}, check);
  check();
  for (const SurfaceMesh& mesh : {confetti(5000), discs(500), folded_cone(5000)}) {
    last = cpu_seconds();
    const TargetSurface surface(mesh, 30, {}, check);
    const detail::BoundaryMesh boundary = sheet(150, check);
    static_cast<void>(detail::assign(boundary, surface.trees(), check));
    check();
  }
  EXPECT_LT(longest, 0.1) << "seconds";
}

}  // namespace
}  // namespace meshsmooth
