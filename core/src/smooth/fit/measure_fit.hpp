#pragma once

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "meshsmooth/target_surface.hpp"
#include "smooth/constraints/constrain.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth::detail {

/// Of rough surfaces each triangle may be one, and a summary must fit in a message.
inline constexpr std::size_t kMostTargetParts = 1000;
inline constexpr std::size_t kMeasuredBetweenChecks = 100;  // positions, each one search

/// The trees of the facets of a boundary as they lie: quads as two triangles.
template <class Get>
[[nodiscard]] SurfaceTrees trees_of_facets(const std::vector<ConstrainedFacet>& facets,
                                           const Get& get, Checkpoint& checkpoint) {
  std::vector<Vec3d> points;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const ConstrainedFacet& facet : facets) {
    const auto first = static_cast<std::int32_t>(points.size());
    for (int k = 0; k < corner_count(facet); ++k) points.push_back(get(facet.nodes[k]));
    triangles.push_back({first, first + 1, first + 2});
    if (corner_count(facet) == 4) triangles.push_back({first, first + 2, first + 3});
  }
  SurfaceFeatures one;
  one.patch_of.assign(triangles.size(), 0);
  one.patch_count = 1;
  return {std::move(points), triangles, std::move(one), checkpoint};
}

/// Completes what a job reports of its target surface: distances per part, and from the surface.
/// On the host; O((nodes + points) log facets).
template <Executor E, class Real>
void measure_fit(E& executor, const TargetSurface& surface, const Constraints<E>& constraints,
                 const JobMesh<E, Real>& job, FitStats& stats) {
  const auto get = [&]<class T>(const T* data, std::size_t count) {
    std::vector<T> host(count);
    executor.download(data, count, host.data());
    return host;
  };
  const auto positions = get(job.positions.data(), job.node_count);
  const auto slots = get(constraints.slots.data(), job.node_count);
  const auto nodes = get(constraints.node_constraints.data(), constraints.node_constraints.size());
  const auto facets = get(constraints.facets.data(), constraints.facets.size());
  executor.synchronize();
  const auto lies = [&](NodeId n) { return vec3_cast<double>(positions[std::size_t(n)]); };
  const SurfaceView view = surface.trees().view();
  stats.parts.resize(static_cast<std::size_t>(view.patch_count + view.curve_count));
  for (std::size_t p = 0; p < stats.parts.size(); ++p) {
    stats.parts[p].curve = !view.is_patch(static_cast<std::int32_t>(p));
  }
  const std::function<void()> check = [&] { executor.check(); };
  Checkpoint checkpoint(check);
  for (std::size_t n = 0; n < slots.size(); ++n) {
    if (n % kMeasuredBetweenChecks == 0) check();
    if (slots[n] < 0) continue;
    const std::int32_t target = nodes[std::size_t(slots[n])].target;
    if (target < 0 || view.is_corner(target)) continue;
    const Vec3d p = vec3_cast<double>(positions[n]);
    const double off = norm(closest_on_entity(view, target, p) - p);
    TargetPart& part = stats.parts[static_cast<std::size_t>(target)];
    ++part.node_count;
    part.distance.largest = std::max(part.distance.largest, off);
    part.distance.mean += off;
  }
  for (TargetPart& part : stats.parts) {
    if (part.node_count > 0) part.distance.mean /= static_cast<double>(part.node_count);
  }
  if (stats.parts.size() > kMostTargetParts) stats.parts.clear();
  if (facets.empty()) return;
  const SurfaceTrees boundary = trees_of_facets(facets, lies, checkpoint);
  SurfaceDistance& distance = stats.surface_to_result;
  std::size_t measured = 0;
  for (const Vec3d p : surface.trees().points()) {
    if (++measured % kMeasuredBetweenChecks == 0) check();
    const double off = std::sqrt(closest_in_tree(boundary.view(), 0, p).closest.squared);
    distance.largest = std::max(distance.largest, off);
    distance.mean += off / static_cast<double>(surface.trees().points().size());
  }
}

}  // namespace meshsmooth::detail
