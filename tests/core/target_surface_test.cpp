// The parts of a target surface, and nearest positions on them.

#include "meshsmooth/target_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "meshsmooth/error.hpp"
#include "support/fit_surfaces.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth {
namespace {

using test::box_surface;
using test::sphere_surface;

struct Parts {
  std::int64_t patches, curves, corners, open;
};

void expect_parts(const SurfaceMesh& mesh, const Parts& parts) {
  const SurfaceCounts counts = TargetSurface(mesh).counts();
  EXPECT_EQ(counts.patches, parts.patches);
  EXPECT_EQ(counts.curves, parts.curves);
  EXPECT_EQ(counts.corners, parts.corners);
  EXPECT_EQ(counts.open_edges, parts.open);
}

TEST(TargetSurface, FindsTheSidesEdgesAndCornersOfABox) {
  expect_parts(box_surface(1, {1, 1, 1}), {6, 12, 8, 0});
  expect_parts(box_surface(5, {1, 2, 3}), {6, 12, 8, 0});
}

TEST(TargetSurface, FindsNoFeatureOnASphere) { expect_parts(sphere_surface(12, 1), {1, 0, 0, 0}); }

TEST(TargetSurface, FindsTheConcaveEdgeOfAnLShape) {
  expect_parts(test::l_surface(2), {8, 18, 12, 0});
}

TEST(TargetSurface, TreatsAnOpenBorderAsAFeature) {
  SurfaceMesh open = box_surface(3, {1, 1, 1});
  std::erase_if(open.triangles, [&](const auto& t) {
    return open.points[t[0]].z == 1 && open.points[t[1]].z == 1 && open.points[t[2]].z == 1;
  });
  expect_parts(open, {5, 12, 8, 12});
}

TEST(TargetSurface, IgnoresTheOrientationOfTriangles) {
  SurfaceMesh inside_out = box_surface(2, {1, 1, 1});
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  expect_parts(inside_out, {6, 12, 8, 0});
  SurfaceMesh mixed = box_surface(2, {1, 1, 1});
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 3) {
    std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  }
  expect_parts(mixed, {6, 12, 8, 0});
}

TEST(TargetSurface, MakesOnePointOfThoseOfATriangleSoup) {
  const SurfaceMesh box = box_surface(2, {1, 1, 1});
  SurfaceMesh soup;
  for (const auto& t : box.triangles) {
    const auto first = static_cast<std::int32_t>(soup.points.size());
    for (const std::int32_t p : t) soup.points.push_back(box.points[p]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  expect_parts(soup, {6, 12, 8, 0});
}

TEST(TargetSurface, CountsDegenerateTrianglesAndSeesThroughThem) {
  SurfaceMesh box = box_surface(2, {1, 1, 1});
  // A sliver in place of an edge: its third point lies on the edge of a neighbour.
  const auto t = box.triangles[0];
  const auto middle = static_cast<std::int32_t>(box.points.size());
  box.points.push_back(0.5 * (box.points[t[0]] + box.points[t[1]]));
  box.triangles[0] = {t[0], middle, t[2]};
  box.triangles.push_back({middle, t[1], t[2]});
  box.triangles.push_back({t[0], t[1], middle});
  box.triangles.push_back({t[0], t[0], t[1]});
  const SurfaceCounts counts = TargetSurface(box).counts();
  EXPECT_EQ(counts.degenerate_triangles, 2);
  EXPECT_EQ(counts.open_edges, 0);
  EXPECT_EQ(counts.patches, 6);
  EXPECT_EQ(counts.corners, 8);
}

TEST(TargetSurface, SeparatesGivenPatches) {
  SurfaceMesh sphere = sphere_surface(12, 1);
  for (const auto& t : sphere.triangles) {
    const double z = sphere.points[t[0]].z + sphere.points[t[1]].z + sphere.points[t[2]].z;
    sphere.patches.push_back(z > 0 ? 7 : 3);
  }
  expect_parts(sphere, {2, 1, 0, 0});
}

TEST(TargetSurface, NamesWhatIsWrong) {
  const auto reason = [](const SurfaceMesh& mesh) {
    try {
      TargetSurface{mesh};
    } catch (const InvalidMesh& error) {
      return error.reason() + " " + error.what();
    }
    return std::string();
  };
  SurfaceMesh box = box_surface(1, {1, 1, 1});
  EXPECT_EQ(reason(box), "");
  SurfaceMesh broken = box;
  broken.triangles[3][1] = 99;
  EXPECT_NE(reason(broken).find("SURFACE_INVALID target surface: triangle 3: point 99"),
            std::string::npos);
  broken = box;
  broken.points[2].y = NAN;
  EXPECT_NE(reason(broken).find("point 2 has a coordinate that is not finite"), std::string::npos);
  broken = box;
  broken.patches = {1, 2};
  EXPECT_NE(reason(broken).find("12 triangles, but 2 patches"), std::string::npos);
  for (Vec3d& p : broken.points) p.z = p.y = 0;
  broken.patches.clear();
  EXPECT_NE(reason(broken).find("no triangle has an area"), std::string::npos);
  EXPECT_NE(reason(SurfaceMesh{}).find("it has no triangle"), std::string::npos);
  broken = box;
  broken.points[5].z = -1e61;
  EXPECT_NE(reason(broken).find("point 5 has a coordinate that is not finite or beyond 1e60"),
            std::string::npos);
}

TEST(TargetSurface, FindsTheNearestPositionThatASearchOfAllFinds) {
  const SurfaceMesh mesh = box_surface(7, {1, 2, 3});
  const TargetSurface surface(mesh);
  const detail::SurfaceView view = surface.trees().view();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> at(-1, 4);
  for (int n = 0; n < 300; ++n) {
    const Vec3d p{at(random), at(random), at(random)};
    double nearest = HUGE_VAL;
    for (const auto& t : mesh.triangles) {
      nearest = std::min(nearest, detail::closest_on_triangle(mesh.points[t[0]], mesh.points[t[1]],
                                                              mesh.points[t[2]], p)
                                      .squared);
    }
    EXPECT_EQ(detail::closest_in_tree(view, view.all_patches(), p).closest.squared, nearest);
    double of_patches = HUGE_VAL;
    for (std::int32_t patch = 0; patch < view.patch_count; ++patch) {
      of_patches = std::min(of_patches, detail::closest_in_tree(view, patch, p).closest.squared);
    }
    EXPECT_EQ(of_patches, nearest);
  }
}

}  // namespace
}  // namespace meshsmooth
