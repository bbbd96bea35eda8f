#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "smooth/base/fixed_nodes.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/constraints/curved_constraint.hpp"
#include "smooth/constraints/find_facets.hpp"
#include "smooth/constraints/node_constraint.hpp"
#include "smooth/constraints/surface_buffers.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Owns the `SlidingConstraints` of a job.
template <Executor E>
struct Constraints {
  typename E::template Buffer<std::int32_t> slots;
  typename E::template Buffer<NodeConstraint> node_constraints;
  typename E::template Buffer<ConstrainedFacet> facets;
  RowBuffer<E, ElementId> facets_of;
  typename E::template Buffer<ElementId> across;  // where some parts of a volume are curved
  bool curved = false;
  double tolerance = 0;       // how far off its facets, plane or line a node may lie
  SurfaceBuffers<E> surface;  // where the job has a target surface

  [[nodiscard]] SlidingConstraints view() const {
    return {slots.data(), node_constraints.data(), facets_of.view(), facets.data(), facets.size(),
            curved,       across.data(),           surface.view};
  }
};

/// Bytes of `Constraints`. Of a surface those of a curved one: sizes do not tell.
[[nodiscard]] inline std::int64_t constraint_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  if (mesh.dimension == 2 && plan.stays_on_surface) {
    return mesh.elements *
               static_cast<std::int64_t>(sizeof(ConstrainedFacet) + 4 * sizeof(ElementId)) +
           mesh.entries * 4 +
           mesh.nodes * static_cast<std::int64_t>(sizeof(NodeConstraint) + 4 + 8);
  }
  if (plan.options.boundary != BoundaryPolicy::slide) return 0;
  // A boundary node has two triangles and six entries in their rows, or one quad or edge.
  const std::int64_t facets = mesh.dimension == 3 && !mesh.only(8) ? 2 : 1;
  // `across` has four entries a facet; a slot has an offset.
  const auto facet = static_cast<std::int64_t>(sizeof(ConstrainedFacet) + 4 * sizeof(ElementId));
  const auto constraint = static_cast<std::int64_t>(sizeof(NodeConstraint));
  return mesh.nodes * 4 + mesh.surface * (facets * (facet + 3 * 4) + constraint + 8);
}

/// Bytes that `constrain` holds while it runs.
[[nodiscard]] inline std::int64_t constraining_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  if (mesh.dimension == 2 && plan.stays_on_surface)
    return mesh.nodes * 8 + mesh.elements * static_cast<std::int64_t>(sizeof(PackedDirection));
  return plan.options.boundary == BoundaryPolicy::slide ? mesh.nodes * 8 : 0;
}

/// Which nodes slide.
struct SlidingCounts {
  std::int64_t in_plane = 0;
  std::int64_t on_line = 0;
  std::int64_t on_surface = 0;
  std::int64_t on_curve = 0;
  std::int64_t curved = 0;  // next to a part that is not planar

  [[nodiscard]] std::int64_t sliding() const { return in_plane + on_line + on_surface + on_curve; }
  friend MESHSMOOTH_HD SlidingCounts operator+(const SlidingCounts& a, const SlidingCounts& b) {
    return {a.in_plane + b.in_plane, a.on_line + b.on_line, a.on_surface + b.on_surface,
            a.on_curve + b.on_curve, a.curved + b.curved};
  }
};

/// Emits the slots of a facet's nodes.
struct VisitSlots {
  const ConstrainedFacet* facets;
  const std::int32_t* slots;

  template <class Emit>
  MESHSMOOTH_HD void operator()(std::size_t facet, const Emit& emit) const {
    for (const NodeId n : facets[facet].nodes) {
      if (n >= 0) emit(slots[n]);
    }
  }
};

/// How far a node may be from its plane or line: 1e-13 of the box, plus the rounding of the
/// coordinates.
template <class Real>
[[nodiscard]] double flatness_of(const Box& box) {
  const double farthest =
      std::max({std::abs(box.lower.x), std::abs(box.lower.y), std::abs(box.lower.z),
                std::abs(box.upper.x), std::abs(box.upper.y), std::abs(box.upper.z)});
  return 1e-13 * box.diagonal() + 4.0 * std::numeric_limits<Real>::epsilon() * farthest;
}

/// Numbers the nodes of facets.
///
/// gives  their slots, -1 for the others; returns how many there are
template <Executor E>
std::size_t number_slots(E& executor, std::size_t node_count, const ConstrainedFacet* facets,
                         std::size_t facet_count, std::int32_t* slots) {
  auto buffer = executor.template allocate<std::int64_t>(node_count + 1);
  std::int64_t* const before = buffer.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { slots[node] = -1; });
  executor.for_each(facet_count, [=] MESHSMOOTH_HD(std::size_t facet) {
    for (const NodeId n : facets[facet].nodes) {
      if (n >= 0) E::store(slots[n], std::int32_t{0});
    }
  });
  executor.for_each(node_count + 1, [=] MESHSMOOTH_HD(std::size_t node) {
    before[node] = node < node_count && slots[node] == 0 ? 1 : 0;
  });
  const std::int64_t count = executor.exclusive_scan(before, node_count + 1);
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (slots[node] == 0) slots[node] = static_cast<std::int32_t>(before[node]);
  });
  return static_cast<std::size_t>(count);
}

/// Finds the constraint of each node with a slot that the caller has not fixed (`mask`, by the
/// caller's ids, or null) and that is on no non-manifold edge, as if all parts were planar: nodes
/// with one are no longer fixed.
/// Nodes next to curved parts get a preliminary curved one, and stay fixed.
///
/// cost   O(facets)
template <Executor E, class Real, class Position>
SlidingCounts find_node_constraints(E& executor, JobMesh<E, Real>& job, const Position* positions,
                                    const SlidingConstraints& sliding,
                                    const NodeConstraintRule& rule, const std::uint8_t* mask,
                                    NodeConstraint* node_constraints) {
  std::uint8_t* const fixed = job.fixed.data();
  const NodeId* const caller_ids = job.caller_ids.data();
  const bool volume = job.volume();
  return executor.reduce(
      job.node_count, SlidingCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (sliding.slots[node] < 0) return SlidingCounts{};
        const auto slot = static_cast<std::size_t>(sliding.slots[node]);
        const auto get = [=](NodeId n) { return vec3_cast<double>(positions[n]); };
        const Vec3d home = get(static_cast<NodeId>(node));
        node_constraints[slot] = {home, {0, 0, 0}, NodeConstraint::point};
        if (mask != nullptr && mask[caller_ids[node]] != 0) return SlidingCounts{};
        if (fixed[node] == kOnNonManifoldEdge) return SlidingCounts{};
        const ElementId* const begin = sliding.facets_of.begin(slot);
        const ElementId* const end = sliding.facets_of.end(slot);
        node_constraints[slot] =
            volume ? PlanesAtNode(sliding.facets, begin, end, home, get, rule).find()
                   : find_constraint_on_surface(sliding.facets, node, begin, end, home, get, rule);
        const NodeConstraint& found = node_constraints[slot];
        if (found.kind == NodeConstraint::plane || found.kind == NodeConstraint::line)
          fixed[node] = 0;
        return SlidingCounts{.in_plane = found.kind == NodeConstraint::plane ? 1 : 0,
                             .on_line = found.kind == NodeConstraint::line ? 1 : 0,
                             .curved = found.curved() ? 1 : 0};
      },
      Plus{});
}

/// On a curved surface mesh: a preliminary curved constraint of each node, a point where it stays:
/// by `mask` (by the caller's ids, or null) and, if `boundary_stays`, where it is fixed.
template <Executor E, class Real, class Position>
void start_on_surface(E& executor, const JobMesh<E, Real>& job, const Position* positions,
                      const SlidingConstraints& sliding, const std::uint8_t* mask,
                      bool boundary_stays, NodeConstraint* node_constraints) {
  const NodeId* const caller_ids = job.caller_ids.data();
  const std::uint8_t* const fixed = job.fixed.data();
  executor.for_each(job.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (sliding.slots[node] < 0) return;
    const bool stays =
        (mask != nullptr && mask[caller_ids[node]] != 0) || (boundary_stays && fixed[node] != 0);
    node_constraints[sliding.slots[node]] = {
        vec3_cast<double>(positions[node]),
        {0, 0, 0},
        stays ? NodeConstraint::point : NodeConstraint::surface};
  });
}

/// If some parts are curved: replaces the constraints of `find_node_constraints`, by the creases
/// between facets; on a surface mesh (`surface`: `regions` of its elements) also between regions.
/// Nodes in a plane or on a line become curved ones too, because the outline around them may
/// change.
///
/// cost   O(facets * min(facets at a node, 256)); 16 B a facet
template <Executor E, class Real>
SlidingCounts find_curved_constraints(E& executor, const JobMesh<E, Real>& job,
                                      Constraints<E>& constraints, const NodeConstraintRule& rule,
                                      bool surface, const Regions& regions, std::uint8_t* fixed) {
  constraints.curved = true;
  const bool faces = surface || job.volume();
  if (faces) {
    constraints.across = executor.template allocate<ElementId>(4 * constraints.facets.size());
    ElementId* const across = constraints.across.data();
    const SlidingConstraints sliding = constraints.view();
    executor.for_each(sliding.facet_count, [=] MESHSMOOTH_HD(std::size_t facet) {
      const auto own = static_cast<ElementId>(facet);
      for (int k = 0; k < 4; ++k) {
        const ElementId other = facet_across(sliding, own, k, rule);
        const bool ends =
            surface && other != SlidingConstraints::kNoFacet && regions[own] != regions[other];
        across[4 * facet + k] = ends ? SlidingConstraints::kNoFacet : other;
      }
    });
  }
  const SlidingConstraints sliding = constraints.view();
  NodeConstraint* const node_constraints = constraints.node_constraints.data();
  return executor.reduce(
      job.node_count, SlidingCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (sliding.slots[node] < 0) return SlidingCounts{};
        NodeConstraint& constraint = node_constraints[sliding.slots[node]];
        const NodeConstraint::Kind flat = constraint.kind;
        if (flat == NodeConstraint::point) return SlidingCounts{};
        const CurvedConstraint found = faces ? FacetsAtNode(sliding, node, rule).find()
                                             : find_constraint_on_edges(sliding, node);
        // Not its home: functors of other nodes read that.
        constraint.direction = found.constraint.direction;
        constraint.kind = found.constraint.kind;
        for (int k = 0; k < 2; ++k) constraint.next[k] = found.constraint.next[k];
        fixed[node] = constraint.kind == NodeConstraint::point ? 1 : 0;
        if (constraint.kind == NodeConstraint::point)
          return SlidingCounts{.curved = found.corner ? 0 : 1};
        if (flat == NodeConstraint::plane) return SlidingCounts{.in_plane = 1};
        if (flat == NodeConstraint::line) return SlidingCounts{.on_line = 1};
        return constraint.kind == NodeConstraint::surface ? SlidingCounts{.on_surface = 1}
                                                          : SlidingCounts{.on_curve = 1};
      },
      Plus{});
}

/// Nodes that slide in a plane or on a line do so through their input position, which need not be
/// where the reference has them.
template <Executor E, class Real>
void slide_from_input(E& executor, const JobMesh<E, Real>& job, const SlidingConstraints& sliding,
                      NodeConstraint* node_constraints) {
  const Vec3<Real>* const positions = job.positions.data();
  executor.for_each(job.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const std::int32_t slot = sliding.slots[node];
    if (slot >= 0) node_constraints[slot].home = vec3_cast<double>(positions[node]);
  });
}

/// Whether nodes between regions are fixed.
[[nodiscard]] inline bool fixes_interfaces(const TopologyView& topology,
                                           const SmoothOptions& options) {
  return !topology.regions.empty() && options.boundary != BoundaryPolicy::free;
}

/// Whether `constrain` has something to do.
[[nodiscard]] inline bool constrains(const TopologyView& topology, const SmoothOptions& options,
                                     bool surface) {
  return surface || options.boundary == BoundaryPolicy::slide ||
         fixes_interfaces(topology, options);
}

/// After step 2: fixes the nodes between regions, and lets those of the boundary and between
/// regions slide, as the options say. On a `surface`, a curved surface mesh whose nodes stay on it,
/// the facets are its elements and all nodes are constrained; those of a free boundary slide.
///
/// takes  `reference`: if not null, positions that tell what is planar, a crease, a corner, instead
///        of the job's own
/// gives  `job.fixed` and the counts of the job's nodes; empty constraints unless nodes slide
/// cost   O(ball entries); while nodes slide 4 B a node and about 350 B a node of the boundary
///        and between regions (on a surface all), 8 B a node while it runs
template <Executor E, class Real>
Constraints<E> constrain(E& executor, const TopologyView& topology, const SmoothOptions& options,
                         bool surface, const Vec3d* reference, JobMesh<E, Real>& job) {
  Constraints<E> result;
  const std::size_t node_count = job.node_count;
  const Rows<ElementId> balls = job.balls.view();
  auto region_array = executor.in_executor_memory(topology.regions);
  const Regions regions{topology.regions.empty() ? nullptr : region_array.data(),
                        job.elements.caller_ids.data()};
  const auto release = [&](std::int64_t count) {
    job.nodes.fixed -= count;
    job.free_count = static_cast<std::size_t>(static_cast<std::int64_t>(job.free_count) + count);
  };
  if (fixes_interfaces(topology, options)) {
    const InterfaceCounts found =
        fix_interfaces(executor, node_count, balls, regions, job.fixed.data());
    job.nodes.between_regions = found.nodes;
    release(-found.were_free);
  }
  if (!surface && options.boundary != BoundaryPolicy::slide) return result;

  auto mask = executor.in_executor_memory(topology.fixed);
  const auto find_facets = [&](const auto* positions) {
    return surface ? facets_of_elements(executor, job.elements.view, regions, positions)
                   : find_constrained_facets(executor, node_count, job.elements.view, balls,
                                             regions, job.fixed.data(), positions);
  };
  result.facets = reference != nullptr ? find_facets(reference) : find_facets(job.positions.data());
  result.slots = executor.template allocate<std::int32_t>(node_count);
  const ConstrainedFacet* const facets = result.facets.data();
  const std::size_t slot_count =
      number_slots(executor, node_count, facets, result.facets.size(), result.slots.data());
  result.facets_of = group_items(executor, slot_count, result.facets.size(),
                                 VisitSlots{facets, result.slots.data()},
                                 [=] MESHSMOOTH_HD(ElementId facet) { return facets[facet].name; });
  result.node_constraints = executor.template allocate<NodeConstraint>(slot_count);
  // Across a node of a surface, which may be coarse, lie two of its edges.
  const double angle = options.feature_angle * std::numbers::pi / 180;
  const double fan_angle = surface ? std::min(2 * angle, std::numbers::pi / 2) : angle;
  const NodeConstraintRule rule{flatness_of<Real>(job.box), std::cos(angle), std::cos(fan_angle)};
  const std::uint8_t* const stays = topology.fixed.empty() ? nullptr : mask.data();
  const auto find_constraints = [&](const auto* positions) {
    if (!surface) {
      return find_node_constraints(executor, job, positions, result.view(), rule, stays,
                                   result.node_constraints.data());
    }
    start_on_surface(executor, job, positions, result.view(), stays,
                     options.boundary == BoundaryPolicy::fixed, result.node_constraints.data());
    return SlidingCounts{};
  };
  SlidingCounts found =
      reference != nullptr ? find_constraints(reference) : find_constraints(job.positions.data());
  if (surface || found.curved > 0) {
    found =
        find_curved_constraints(executor, job, result, rule, surface, regions, job.fixed.data());
  } else if (reference != nullptr) {
    slide_from_input(executor, job, result.view(), result.node_constraints.data());
  }
  result.tolerance = rule.flatness;
  job.nodes.sliding_in_plane = found.in_plane;
  job.nodes.sliding_on_line = found.on_line;
  job.nodes.sliding_on_surface = found.on_surface;
  job.nodes.sliding_on_curve = found.on_curve;
  job.nodes.curved = found.curved;
  // On a surface every free node slides, and some that were free may not.
  release(found.sliding() - (surface ? static_cast<std::int64_t>(job.free_count) : 0));
  return result;
}

}  // namespace meshsmooth::detail
