#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "smooth/bent_freedom.hpp"
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
  typename E::template Buffer<ElementId> across;  // where some parts of a volume are curved
  bool bent = false;
  double tolerance = 0;  // how far off its facets, plane or line a node may lie

  [[nodiscard]] Slides view() const {
    return {slots.data(), freedoms.data(), facets_of.view(), facets.data(), facets.size(),
            bent,         across.data()};
  }
};

/// Which nodes slide.
struct SlideCounts {
  std::int64_t in_plane = 0;
  std::int64_t on_line = 0;
  std::int64_t on_surface = 0;
  std::int64_t on_curve = 0;
  std::int64_t curved = 0;  // beside a part that is not planar

  [[nodiscard]] std::int64_t sliding() const { return in_plane + on_line + on_surface + on_curve; }
  friend MESHSMOOTH_HD SlideCounts operator+(const SlideCounts& a, const SlideCounts& b) {
    return {a.in_plane + b.in_plane, a.on_line + b.on_line, a.on_surface + b.on_surface,
            a.on_curve + b.on_curve, a.curved + b.curved};
  }
};

struct AddSlideCounts {
  MESHSMOOTH_HD SlideCounts operator()(const SlideCounts& a, const SlideCounts& b) const {
    return a + b;
  }
};

/// Emits the slots of a facet's nodes.
struct VisitSlots {
  const KeptFacet* facets;
  const std::int32_t* slots;

  template <class Emit>
  MESHSMOOTH_HD void operator()(std::size_t facet, const Emit& emit) const {
    for (const NodeId n : facets[facet].nodes) {
      if (n >= 0) emit(slots[n]);
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

/// Numbers the nodes of facets.
///
/// gives  their slots, -1 for the others; returns how many there are
template <Executor E>
std::size_t number_slots(E& executor, std::size_t node_count, const KeptFacet* facets,
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

/// Finds the freedom of each node with a slot that the caller does not hold (`mask`, by the
/// caller's ids, or null), as if all parts were planar: those with one are no longer fixed.
/// Those beside curved parts get a bent one to begin with, and stay fixed.
///
/// cost   O(facets at a node squared)
template <Executor E, class Real>
SlideCounts find_freedoms(E& executor, const JobMesh<E, Real>& job, const Slides& slides,
                          const FreedomRule& rule, const std::uint8_t* mask, Freedom* freedoms,
                          std::uint8_t* fixed) {
  const Vec3<Real>* const places = job.places.data();
  const NodeId* const caller_of = job.caller_of.data();
  const bool volume = job.volume();
  return executor.reduce(
      job.node_count, SlideCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (slides.slots[node] < 0) return SlideCounts{};
        const auto slot = static_cast<std::size_t>(slides.slots[node]);
        const auto get = [=](NodeId n) { return vec3_cast<double>(places[n]); };
        const Vec3d home = get(static_cast<NodeId>(node));
        freedoms[slot] = {home, {0, 0, 0}, Freedom::point};
        if (mask != nullptr && mask[caller_of[node]] != 0) return SlideCounts{};
        const ElementId* const begin = slides.facets_of.begin(slot);
        const ElementId* const end = slides.facets_of.end(slot);
        freedoms[slot] =
            volume ? find_freedom_in_space(slides.facets, begin, end, home, get, rule)
                   : find_freedom_on_surface(slides.facets, node, begin, end, home, get, rule);
        const Freedom& found = freedoms[slot];
        if (found.kind == Freedom::plane || found.kind == Freedom::line) fixed[node] = 0;
        return SlideCounts{.in_plane = found.kind == Freedom::plane ? 1 : 0,
                           .on_line = found.kind == Freedom::line ? 1 : 0,
                           .curved = found.bent() ? 1 : 0};
      },
      AddSlideCounts{});
}

/// Where some parts are curved: looks again at the freedoms that `find_freedoms` gave, by the
/// creases between facets. Nodes in a plane or on a line become bent ones too: what
/// is around them may now change its outline.
///
/// cost   O(facets at a node squared); 16 B a facet
template <Executor E, class Real>
SlideCounts bend_freedoms(E& executor, const JobMesh<E, Real>& job, Constraints<E>& constraints,
                          const FreedomRule& rule, std::uint8_t* fixed) {
  constraints.bent = true;
  const bool volume = job.volume();
  if (volume) {
    constraints.across = executor.template allocate<ElementId>(4 * constraints.facets.size());
    ElementId* const across = constraints.across.data();
    const Slides slides = constraints.view();
    executor.for_each(slides.facet_count, [=] MESHSMOOTH_HD(std::size_t facet) {
      for (int k = 0; k < 4; ++k) {
        across[4 * facet + k] = facet_across(slides, static_cast<ElementId>(facet), k, rule);
      }
    });
  }
  const Slides slides = constraints.view();
  Freedom* const freedoms = constraints.freedoms.data();
  return executor.reduce(
      job.node_count, SlideCounts{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (slides.slots[node] < 0) return SlideCounts{};
        Freedom& freedom = freedoms[slides.slots[node]];
        const Freedom::Kind flat = freedom.kind;
        if (flat == Freedom::point) return SlideCounts{};
        const BentFreedom found =
            volume ? FacetsAtNode(slides, node, rule).find() : find_freedom_on_edges(slides, node);
        // Not its home: bodies of other nodes read that.
        freedom.direction = found.freedom.direction;
        freedom.kind = found.freedom.kind;
        for (int k = 0; k < 2; ++k) freedom.next[k] = found.freedom.next[k];
        fixed[node] = freedom.kind == Freedom::point ? 1 : 0;
        if (freedom.kind == Freedom::point) return SlideCounts{.curved = found.corner ? 0 : 1};
        if (flat == Freedom::plane) return SlideCounts{.in_plane = 1};
        if (flat == Freedom::line) return SlideCounts{.on_line = 1};
        return freedom.kind == Freedom::surface ? SlideCounts{.on_surface = 1}
                                                : SlideCounts{.on_curve = 1};
      },
      AddSlideCounts{});
}

/// After step 2: fixes the nodes between regions, and lets those of the boundary and between
/// regions slide, as the options say.
///
/// gives  `job.fixed` and the counts of the job's nodes; empty constraints unless nodes slide
/// cost   O(ball entries); while nodes slide 4 B a node and about 350 B a node of the boundary
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
  const KeptFacet* const facets = result.facets.data();
  const std::size_t slot_count =
      number_slots(executor, node_count, facets, result.facets.size(), result.slots.data());
  result.facets_of = group_items(executor, slot_count, result.facets.size(),
                                 VisitSlots{facets, result.slots.data()},
                                 [=] MESHSMOOTH_HD(ElementId facet) { return facets[facet].name; });
  result.freedoms = executor.template allocate<Freedom>(slot_count);
  const FreedomRule rule{flatness_of<Real>(job.box),
                         std::cos(options.feature_angle * std::numbers::pi / 180)};
  SlideCounts found = find_freedoms(executor, job, result.view(), rule,
                                    topology.fixed.empty() ? nullptr : mask.data(),
                                    result.freedoms.data(), job.fixed.data());
  if (found.curved > 0) found = bend_freedoms(executor, job, result, rule, job.fixed.data());
  result.tolerance = rule.flatness;
  job.nodes.sliding_in_plane = found.in_plane;
  job.nodes.sliding_on_line = found.on_line;
  job.nodes.sliding_on_surface = found.on_surface;
  job.nodes.sliding_on_curve = found.on_curve;
  job.nodes.curved = found.curved;
  release(found.sliding());
  return result;
}

}  // namespace meshsmooth::detail
