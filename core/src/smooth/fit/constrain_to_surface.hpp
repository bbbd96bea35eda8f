#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "smooth/base/refusals.hpp"
#include "smooth/constraints/constrain.hpp"
#include "surface/assign.hpp"

namespace meshsmooth::detail {

/// What the host knows of a job's boundary while nodes are assigned.
struct HostBoundary {
  std::vector<ConstrainedFacet> facets;
  std::vector<std::int32_t> slots;    // by node
  std::vector<NodeConstraint> nodes;  // by slot
  std::vector<NodeId> node_of;        // by slot
  std::vector<std::uint8_t> held;     // by slot: it has no place on the surface
};

/// The boundary as a graph of slots.
[[nodiscard]] inline BoundaryMesh graph_of(const HostBoundary& boundary, double feature_angle,
                                           const std::function<void()>& check) {
  std::vector<Vec3d> points;
  for (const NodeConstraint& node : boundary.nodes) points.push_back(node.home);
  std::vector<BoundaryFacet> facets;
  for (const ConstrainedFacet& facet : boundary.facets) {
    BoundaryFacet slots{-1, -1, -1, -1};
    for (std::size_t k = 0; k < 4; ++k) {
      const NodeId n = facet.nodes[k];
      if (n >= 0) slots[k] = boundary.slots[static_cast<std::size_t>(n)];
    }
    facets.push_back(slots);
  }
  return {std::move(points), std::move(facets), feature_angle, check};
}

/// Turns an assignment into constraints.
inline void apply(const Assignment& assignment, const SurfaceView& surface,
                  HostBoundary& boundary) {
  for (std::size_t slot = 0; slot < boundary.nodes.size(); ++slot) {
    NodeConstraint& node = boundary.nodes[slot];
    const std::int32_t entity = assignment.entities[slot];
    if (boundary.held[slot] != 0 || entity < 0) continue;
    node.target = entity;
    node.off_target = true;
    node.direction = direction_at(surface, entity, node.home);
    node.kind = surface.is_corner(entity)  ? NodeConstraint::point
                : surface.is_patch(entity) ? NodeConstraint::surface
                                           : NodeConstraint::curve;
    if (node.kind != NodeConstraint::curve) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      node.next[k] = boundary.node_of[static_cast<std::size_t>(assignment.next[slot][k])];
    }
  }
}

/// The boundary on the host. Nodes that the caller fixed (`fixed`, by the caller's ids, or empty),
/// or between regions (`interface`, by node), have no place on a surface.
template <Executor E, class Real>
HostBoundary download_boundary(E& executor, const JobMesh<E, Real>& job, const Constraints<E>& from,
                               std::size_t slot_count, std::span<const std::uint8_t> fixed,
                               const std::uint8_t* interface) {
  const auto get = [&]<class T>(const T* data, std::size_t count) {
    std::vector<T> host(count);
    executor.download(data, count, host.data());
    return host;
  };
  HostBoundary result{get(from.facets.data(), from.facets.size()),
                      get(from.slots.data(), job.node_count),
                      std::vector<NodeConstraint>(slot_count), std::vector<NodeId>(slot_count),
                      std::vector<std::uint8_t>(slot_count)};
  const auto positions = get(job.positions.data(), job.node_count);
  const auto caller_ids = get(job.caller_ids.data(), job.node_count);
  const auto between = interface == nullptr ? std::vector<std::uint8_t>(job.node_count)
                                            : get(interface, job.node_count);
  for (std::size_t n = 0; n < job.node_count; ++n) {
    if (result.slots[n] < 0) continue;
    const auto slot = static_cast<std::size_t>(result.slots[n]);
    result.nodes[slot] = {vec3_cast<double>(positions[n]), {0, 0, 0}, NodeConstraint::point};
    result.node_of[slot] = static_cast<NodeId>(n);
    const bool by_caller = !fixed.empty() && fixed[static_cast<std::size_t>(caller_ids[n])] != 0;
    result.held[slot] = by_caller || between[n] != 0 ? 1 : 0;
  }
  return result;
}

/// Frees the nodes that slide on patches and curves, and counts them.
template <Executor E, class Real>
void release_nodes(E& executor, const SlidingConstraints& sliding, JobMesh<E, Real>& job) {
  std::uint8_t* const fixed = job.fixed.data();
  const SlidingCounts found = executor.reduce(
      job.node_count, SlidingCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const NodeConstraint* const constraint = sliding.constraint(node);
        if (constraint == nullptr || !constraint->curved()) return SlidingCounts{};
        fixed[node] = 0;
        return constraint->kind == NodeConstraint::curve ? SlidingCounts{.on_curve = 1}
                                                         : SlidingCounts{.on_surface = 1};
      },
      Plus{});
  job.nodes.sliding_on_surface = found.on_surface;
  job.nodes.sliding_on_curve = found.on_curve;
  job.nodes.fixed -= found.sliding();
  job.free_count += static_cast<std::size_t>(found.sliding());
}

/// As `constrain`, to a target surface: the boundary's nodes belong to its corners, curves and
/// patches, and are off them at first. Nodes between regions are fixed.
///
/// gives  `surface`, without the creases that the boundary has no edges along
/// cost   O(ball entries), and on the host that of `assign`
template <Executor E, class Real>
Constraints<E> constrain_to_surface(E& executor, const TopologyView& topology,
                                    const SurfaceMesh& given, double feature_angle,
                                    JobMesh<E, Real>& job, std::optional<TargetSurface>& surface,
                                    FitStats& stats) {
  refuse_beyond_surfaces(job.box.lower, job.box.upper);
  Constraints<E> result;
  const Regions one_region{nullptr, job.elements.caller_ids.data()};
  result.facets =
      find_constrained_facets(executor, job.node_count, job.elements.view, job.balls.view(),
                              one_region, job.fixed.data(), job.positions.data());
  typename E::template Buffer<std::uint8_t> interface;
  if (!topology.regions.empty()) {
    auto region_array = executor.in_executor_memory(topology.regions);
    interface = executor.template allocate<std::uint8_t>(job.node_count);
    std::uint8_t* const between = interface.data();
    executor.for_each(job.node_count, [=] MESHSMOOTH_HD(std::size_t n) { between[n] = 0; });
    const Regions regions{region_array.data(), job.elements.caller_ids.data()};
    job.nodes.between_regions =
        fix_interfaces(executor, job.node_count, job.balls.view(), regions, between).nodes;
    const InterfaceCounts found =
        fix_interfaces(executor, job.node_count, job.balls.view(), regions, job.fixed.data());
    job.nodes.fixed += found.were_free;
    job.free_count -= static_cast<std::size_t>(found.were_free);
  }
  result.slots = executor.template allocate<std::int32_t>(job.node_count);
  const ConstrainedFacet* const facets = result.facets.data();
  const std::size_t slot_count =
      number_slots(executor, job.node_count, facets, result.facets.size(), result.slots.data());
  result.facets_of = group_items(executor, slot_count, result.facets.size(),
                                 VisitSlots{facets, result.slots.data()},
                                 [=] MESHSMOOTH_HD(ElementId facet) { return facets[facet].name; });
  HostBoundary boundary =
      download_boundary(executor, job, result, slot_count, topology.fixed, interface.data());
  const std::function<void()> check = [&] { executor.check(); };
  const BoundaryMesh graph = graph_of(boundary, feature_angle, check);
  surface.emplace(given, feature_angle, std::span<const std::array<std::int32_t, 2>>(), check);
  Assignment assignment = assign(graph, surface->trees(), check);
  if (!assignment.bends.empty()) {
    surface.emplace(given, feature_angle, assignment.bends, check);
    assignment = assign(graph, surface->trees(), check);
  }
  const SurfaceTrees& trees = surface->trees();
  result.surface = SurfaceBuffers<E>(executor, trees);
  apply(assignment, trees.view(), boundary);
  result.node_constraints = executor.template allocate<NodeConstraint>(slot_count);
  executor.upload(boundary.nodes.data(), slot_count, result.node_constraints.data());
  executor.synchronize();  // the host's arrays end here
  result.curved = true;
  result.tolerance = flatness_of<Real>(job.box);
  release_nodes(executor, result.view(), job);
  stats.surface = surface->counts();
  stats.unmatched_corner_count = assignment.unmatched_corners;
  stats.unmatched_curve_count = assignment.unmatched_curves;
  for (const NodeConstraint& node : boundary.nodes) {
    ++(node.target >= 0 ? stats.node_count : stats.fixed_count);
  }
  return result;
}

}  // namespace meshsmooth::detail
