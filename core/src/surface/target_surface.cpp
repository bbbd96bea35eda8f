#include "meshsmooth/target_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include "meshsmooth/error.hpp"
#include "surface/checkpoint.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw InvalidMesh("SURFACE_INVALID", "target surface: " + why);
}

}  // namespace

void validate_surface(const SurfaceMesh& mesh) {
  if (mesh.triangles.empty()) refuse("it has no triangle");
  const auto count = static_cast<std::int32_t>(mesh.points.size());
  const auto check = [&](const char* what, std::size_t id, std::int32_t point) {
    if (point >= 0 && point < count) return;
    refuse(std::string(what) + " " + std::to_string(id) + ": point " + std::to_string(point) +
           " is out of range, the surface has " + std::to_string(count) + " points");
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t p : mesh.triangles[t]) check("triangle", t, p);
  }
  for (std::size_t e = 0; e < mesh.edges.size(); ++e) {
    for (const std::int32_t p : mesh.edges[e]) check("edge", e, p);
  }
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) check("corner", c, mesh.corners[c]);
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    const Vec3d at = mesh.points[p];
    const double largest = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
    if (std::isfinite(at.x + at.y + at.z) && largest <= kMostSurfaceCoordinate) continue;
    refuse("point " + std::to_string(p) + " has a coordinate that is not finite or beyond 1e60");
  }
  if (!mesh.patches.empty() && mesh.patches.size() != mesh.triangles.size()) {
    refuse(std::to_string(mesh.triangles.size()) + " triangles, but " +
           std::to_string(mesh.patches.size()) + " patches");
  }
}

namespace {

/// The points that something refers to, without repetitions; without triangles of fewer than three.
SurfaceMesh weld(const SurfaceMesh& mesh, std::int64_t& dropped, detail::Checkpoint& checkpoint) {
  const auto key = [&](std::int32_t p) {
    const Vec3d& at = mesh.points[std::size_t(p)];
    return std::tuple(at.x, at.y, at.z, p);
  };
  std::vector<std::int32_t> order(mesh.points.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](std::int32_t a, std::int32_t b) {
    checkpoint();
    return key(a) < key(b);
  });
  std::vector<std::int32_t> first(mesh.points.size());  // with the same coordinates
  for (std::size_t n = 0; n < order.size(); ++n) {
    const auto own = std::size_t(order[n]);
    const bool same = n > 0 && mesh.points[own] == mesh.points[std::size_t(order[n - 1])];
    first[own] = same ? first[std::size_t(order[n - 1])] : order[n];
  }
  std::vector<std::uint8_t> used(mesh.points.size());
  const auto use = [&](std::int32_t p) { used[std::size_t(first[std::size_t(p)])] = 1; };
  for (const auto& triangle : mesh.triangles) std::ranges::for_each(triangle, use);
  for (const auto& edge : mesh.edges) std::ranges::for_each(edge, use);
  std::ranges::for_each(mesh.corners, use);
  SurfaceMesh result;
  std::vector<std::int32_t> number(mesh.points.size());
  for (std::size_t p = 0; p < number.size(); ++p) {
    if (used[p] == 0) continue;
    number[p] = static_cast<std::int32_t>(result.points.size());
    result.points.push_back(mesh.points[p]);
  }
  const auto to = [&](std::int32_t p) { return number[std::size_t(first[std::size_t(p)])]; };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    checkpoint();
    const auto& c = mesh.triangles[t];
    const std::array<std::int32_t, 3> own{to(c[0]), to(c[1]), to(c[2])};
    if (own[0] == own[1] || own[1] == own[2] || own[2] == own[0]) {
      ++dropped;
      continue;
    }
    result.triangles.push_back(own);
    if (!mesh.patches.empty()) result.patches.push_back(mesh.patches[t]);
  }
  for (const auto& edge : mesh.edges) {
    if (to(edge[0]) != to(edge[1])) result.edges.push_back({to(edge[0]), to(edge[1])});
  }
  for (const std::int32_t p : mesh.corners) result.corners.push_back(to(p));
  return result;
}

}  // namespace

TargetSurface::TargetSurface(const SurfaceMesh& mesh, double feature_angle,
                             std::span<const std::array<std::int32_t, 2>> bends,
                             const std::function<void()>& check) {
  validate_surface(mesh);
  detail::Checkpoint checkpoint(check);
  std::int64_t dropped = 0;
  SurfaceMesh own = weld(mesh, dropped, checkpoint);
  if (!own.triangles.empty()) {
    detail::SurfaceFeatures features =
        detail::find_features(own, feature_angle, bends, counts_, checkpoint);
    counts_.triangles = static_cast<std::int64_t>(own.triangles.size());
    if (counts_.degenerate_triangles < counts_.triangles) {
      trees_ = std::make_unique<const detail::SurfaceTrees>(std::move(own.points), own.triangles,
                                                            std::move(features), checkpoint);
    }
  }
  counts_.degenerate_triangles += dropped;
  if (!trees_) refuse("no triangle has an area, of " + std::to_string(mesh.triangles.size()));
}

TargetSurface::~TargetSurface() = default;

std::int64_t TargetSurface::estimate_bytes(std::int64_t points, std::int64_t triangles) {
  // Points with their copy, order, numbers and feature edges; triangles with their edges, normals,
  // items of two trees and boxes, and the feature edges' sets.
  return points * 160 + triangles * 640;
}

}  // namespace meshsmooth
