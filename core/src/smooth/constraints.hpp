#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "smooth/freedom.hpp"
#include "smooth/job_mesh.hpp"
#include "smooth/kept_facets.hpp"

namespace meshsmooth::detail {

/// Owns what the sweeps need to know of sliding nodes.
template <Executor E>
struct Constraints {
  typename E::template Buffer<std::int32_t> slots;
  typename E::template Buffer<Freedom> freedoms;
  typename E::template Buffer<KeptFacet> facets;
  RowBuffer<E, ElementId> facets_of;

  [[nodiscard]] Slides view() const {
    return {slots.data(), freedoms.data(), facets_of.view(), facets.data(), facets.size()};
  }
};

/// Which nodes slide.
struct SlideCounts {
  std::int64_t in_plane = 0;
  std::int64_t on_line = 0;
  std::int64_t curved = 0;

  friend MESHSMOOTH_HD SlideCounts operator+(const SlideCounts& a, const SlideCounts& b) {
    return {a.in_plane + b.in_plane, a.on_line + b.on_line, a.curved + b.curved};
  }
};

/// Emits the slots of a facet's nodes.
struct VisitSlots {
  const KeptFacet* facets;
  const std::int32_t* slots;

  template <class Emit>
  MESHSMOOTH_HD void operator()(std::size_t facet, const Emit& emit) const {
    for (const NodeId n : facets[facet].nodes) {
      if (n >= 0 && slots[n] >= 0) emit(slots[n]);
    }
  }
};

/// How far from its plane or line a node may lie: 1e-13 of the box, and what the rounding of
/// the coordinates makes.
template <class Real>
[[nodiscard]] double flatness_of(const Box& box) {
  const double farthest =
      std::max({std::abs(box.lower.x), std::abs(box.lower.y), std::abs(box.lower.z),
                std::abs(box.upper.x), std::abs(box.upper.y), std::abs(box.upper.z)});
  return 1e-13 * box.diagonal() + 4.0 * std::numeric_limits<Real>::epsilon() * farthest;
}

/// Numbers the nodes that may get a freedom: those that are fixed, but not by the caller.
///
/// gives  their slots, -1 for the others; returns how many there are
template <Executor E>
std::size_t number_slots(E& executor, std::size_t node_count, const Rows<ElementId>& balls,
                         const NodeId* caller_of, const std::uint8_t* mask,
                         const std::uint8_t* fixed, std::int32_t* slots) {
  auto buffer = executor.template allocate<std::int64_t>(node_count + 1);
  std::int64_t* const before = buffer.data();
  const auto may_slide = [=] MESHSMOOTH_HD(std::size_t node) {
    return fixed[node] != 0 && balls.size(node) > 0 &&
           (mask == nullptr || mask[caller_of[node]] == 0);
  };
  executor.for_each(node_count + 1, [=] MESHSMOOTH_HD(std::size_t node) {
    before[node] = node < node_count && may_slide(node) ? 1 : 0;
  });
  const std::int64_t count = executor.exclusive_scan(before, node_count + 1);
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    slots[node] = may_slide(node) ? static_cast<std::int32_t>(before[node]) : -1;
  });
  return static_cast<std::size_t>(count);
}

/// Finds the freedom of each node with a slot; those with one are no longer fixed.
///
/// cost   O(facets at a node squared)
template <Executor E, class Real>
SlideCounts find_freedoms(E& executor, const JobMesh<E, Real>& job, const Slides& slides,
                          const FreedomRule& rule, Freedom* freedoms, std::uint8_t* fixed) {
  const Vec3<Real>* const places = job.places.data();
  const bool volume = job.volume();
  return executor.reduce(
      job.node_count, SlideCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (slides.slots[node] < 0) return SlideCounts{};
        const auto slot = static_cast<std::size_t>(slides.slots[node]);
        const auto get = [=](NodeId n) { return vec3_cast<double>(places[n]); };
        const Vec3d home = get(static_cast<NodeId>(node));
        const ElementId* const begin = slides.facets_of.begin(slot);
        const ElementId* const end = slides.facets_of.end(slot);
        const FoundFreedom found =
            volume ? find_freedom_in_space(slides.facets, begin, end, home, get, rule)
                   : find_freedom_on_surface(slides.facets, node, begin, end, home, get, rule);
        freedoms[slot] = found.freedom;
        if (found.freedom.kind != Freedom::point) fixed[node] = 0;
        return SlideCounts{found.freedom.kind == Freedom::plane ? 1 : 0,
                           found.freedom.kind == Freedom::line ? 1 : 0, found.curved ? 1 : 0};
      },
      [] MESHSMOOTH_HD(const SlideCounts& a, const SlideCounts& b) { return a + b; });
}

/// After step 2: fixes the nodes between regions, and lets those of the boundary and between
/// regions slide, as the options say.
///
/// gives  `job.fixed` and the counts of the job's nodes; empty constraints unless nodes slide
/// cost   O(ball entries); while nodes slide 4 B a node and about 300 B a node of the boundary
///        and between regions, 8 B a node while it runs
template <Executor E, class Real>
Constraints<E> constrain(E& executor, const TopologyView& topology, const SmoothOptions& options,
                         const JobControl& control, JobMesh<E, Real>& job, StageTimes& times) {
  Constraints<E> result;
  const bool slide = options.boundary == BoundaryPolicy::slide;
  if (options.boundary == BoundaryPolicy::free || (!slide && topology.regions.empty())) {
    return result;
  }
  const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
  const std::size_t node_count = job.node_count;
  const Rows<ElementId> balls = job.balls.view();
  auto region_array = executor.in_executor_memory(topology.regions);
  const Regions regions{topology.regions.empty() ? nullptr : region_array.data(),
                        job.elements.caller_of.data()};
  const auto release = [&](std::int64_t count) {
    job.nodes.fixed -= count;
    job.free_count = static_cast<std::size_t>(static_cast<std::int64_t>(job.free_count) + count);
  };
  if (regions.of_caller != nullptr) {
    const InterfaceCounts found =
        fix_interfaces(executor, node_count, balls, regions, job.fixed.data());
    job.nodes.between_regions = found.nodes;
    release(-found.were_free);
  }
  if (!slide) return result;

  auto mask = executor.in_executor_memory(topology.fixed);
  result.facets = find_kept_facets(executor, node_count, job.elements.view, balls, regions,
                                   job.fixed.data(), job.places.data());
  result.slots = executor.template allocate<std::int32_t>(node_count);
  const std::size_t slot_count = number_slots(executor, node_count, balls, job.caller_of.data(),
                                              topology.fixed.empty() ? nullptr : mask.data(),
                                              job.fixed.data(), result.slots.data());
  const KeptFacet* const facets = result.facets.data();
  result.facets_of = group_items(executor, slot_count, result.facets.size(),
                                 VisitSlots{facets, result.slots.data()},
                                 [=] MESHSMOOTH_HD(ElementId facet) { return facets[facet].name; });
  result.freedoms = executor.template allocate<Freedom>(slot_count);
  const FreedomRule rule{flatness_of<Real>(job.box),
                         std::cos(options.feature_angle * std::numbers::pi / 180)};
  const SlideCounts found =
      find_freedoms(executor, job, result.view(), rule, result.freedoms.data(), job.fixed.data());
  job.nodes.sliding_in_plane = found.in_plane;
  job.nodes.sliding_on_line = found.on_line;
  job.nodes.curved = found.curved;
  release(found.in_plane + found.on_line);
  return result;
}

}  // namespace meshsmooth::detail
