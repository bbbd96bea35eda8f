#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/positions.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/energy/box_lengths.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Owns the `Targets` of a job.
template <Executor E>
struct TargetArrays {
  typename E::template Buffer<Vec3d> reference;
  typename E::template Buffer<BoxLengths> boxes;
  Targets view;
  std::int64_t flat = 0;  // elements of the reference
};

/// Bytes that `find_boxes` holds while it runs.
[[nodiscard]] inline std::int64_t finding_boxes_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  return plan.aim == Aim::boxes ? mesh.boxes * std::int64_t{sizeof(BoxLengths)} : 0;
}

/// Bytes of `TargetArrays` and anchors.
[[nodiscard]] inline std::int64_t target_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  const std::int64_t anchors =
      plan.anchor_weight > 0 ? mesh.nodes * std::int64_t{sizeof(Anchor)} : 0;
  if (plan.has_reference()) return anchors + mesh.nodes * std::int64_t{sizeof(Vec3d)};
  return anchors + finding_boxes_bytes(mesh, plan);  // as many are kept
}

/// What `find_reference` finds in a reference.
struct ReferenceCheck {
  std::int64_t flat = 0;
  double least = 1;  // corner's share, of the others

  friend MESHSMOOTH_HD ReferenceCheck operator+(const ReferenceCheck& a, const ReferenceCheck& b) {
    return {a.flat + b.flat, a.least < b.least ? a.least : b.least};
  }
};

template <int kDimension, Executor E>
ReferenceCheck check_reference(E& executor, const Elements& elements, const Vec3d* reference) {
  return executor.reduce(
      elements.count, ReferenceCheck{},
      [=] MESHSMOOTH_HD(std::size_t e) {
        const ElementView element = elements[e];
        const double share = least_corner_share<kDimension>(
            *element.shape, [&](int n) { return reference[element.nodes[n]]; });
        return share > kFlatShare ? ReferenceCheck{0, share} : ReferenceCheck{1, 1};
      },
      Plus{});
}

/// The positions `from` in an order, null for the same, in double.
template <Executor E, class Real>
void order_reference(E& executor, std::size_t node_count, const Vec3<Real>* from,
                     const NodeId* order, Vec3d* to) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    to[node] = vec3_cast<double>(from[order == nullptr ? node : order[node]]);
  });
}

/// The reference of a job in internal order, and how many of its elements are flat or inverted.
///
/// gives  nothing unless elements aim at a reference
/// cost   O(nodes + elements); 24 B a node
/// throws InvalidMesh where all elements of the reference are flat
template <Executor E, class Real>
TargetArrays<E> find_reference(E& executor, const JobMesh<E, Real>& job, const JobPlan& plan,
                               const PositionsView& given) {
  TargetArrays<E> result;
  if (!plan.has_reference()) return result;
  result.reference = executor.template allocate<Vec3d>(job.node_count);
  Vec3d* const reference = result.reference.data();
  if (plan.aim == Aim::input) {
    order_reference<E, Real>(executor, job.node_count, job.positions.data(), nullptr, reference);
  } else {
    std::visit(
        [&](const auto& positions) {
          const auto array = executor.in_executor_memory(positions);
          order_reference(executor, job.node_count, array.data(), job.caller_ids.data(), reference);
        },
        given);
  }
  const ReferenceCheck check = job.volume()
                                   ? check_reference<3>(executor, job.elements.view, reference)
                                   : check_reference<2>(executor, job.elements.view, reference);
  // Of an input all of whose elements are flat or inverted, `refuse_tangled` tells more.
  if (plan.aim == Aim::reference) refuse_flat_reference(check.flat, job.elements.view.count);
  result.flat = check.flat;
  result.view.reference = reference;
  result.view.some_flat = check.flat > 0;
  result.view.certainty = std::pow(check.least, 2.0 / job.elements.dimension);
  return result;
}

/// Simplices of a mesh; in internal order they come first.
[[nodiscard]] inline std::size_t simplex_count(const TopologyView& topology) {
  return topology.element_count() - static_cast<std::size_t>(count_mesh(size_of(topology)).boxes);
}

template <int kDimension, Executor E, class Real>
void measure_boxes(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                   std::size_t first, std::size_t count, const BoxLengths* evened,
                   BoxLengths* boxes) {
  executor.for_each(count, [=] MESHSMOOTH_HD(std::size_t n) {
    const ElementView element = around.elements[first + n];
    boxes[n] = box_of<kDimension>(
        *element.shape, [&](int m) { return vec3_cast<double>(positions[element.nodes[m]]); },
        around.reference_of(first + n), evened[n]);
  });
}

/// Passes of `evened_lengths`, an odd number.
inline constexpr int kEveningPasses = 5;

/// The boxes of the elements that are no simplices, from their input positions.
///
/// cost   O(ball entries); 32 B for each such element, half of it kept
template <Executor E, class Real>
void find_boxes(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                std::size_t first, TargetArrays<E>& result) {
  const std::size_t count = around.elements.count - first;
  if (count == 0) return;
  result.boxes = executor.template allocate<BoxLengths>(count);
  auto evened = executor.template allocate<BoxLengths>(count);
  BoxLengths* from = result.boxes.data();
  BoxLengths* to = evened.data();
  BoxLengths* const logs = from;
  executor.for_each(count, [=] MESHSMOOTH_HD(std::size_t n) {
    const ElementView element = around.elements[first + n];
    logs[n] = log_lengths(*element.shape,
                          [&](int m) { return vec3_cast<double>(positions[element.nodes[m]]); });
  });
  static_assert(kEveningPasses % 2 == 1, "the last pass writes to `evened`");
  for (int pass = 0; pass < kEveningPasses; ++pass) {
    executor.for_each(count, [=] MESHSMOOTH_HD(std::size_t n) {
      to[n] = evened_lengths(around, first + n, from, first);
    });
    std::swap(from, to);
  }
  if (around.surface()) {
    measure_boxes<2>(executor, around, positions, first, count, evened.data(), result.boxes.data());
  } else {
    measure_boxes<3>(executor, around, positions, first, count, evened.data(), result.boxes.data());
  }
  result.view.boxes = result.boxes.data();
  result.view.first_box = first;
  result.view.certainty = std::pow(1 / kBoxSkewness, around.surface() ? 1 : 2.0 / 3);
}

/// The anchors of `Optimize::stay`, empty if it is 0.
///
/// cost   O(ring entries); 32 B a node
template <Executor E, class Real>
typename E::template Buffer<Anchor> find_anchors(E& executor, const Surroundings& around,
                                                 const Vec3<Real>* positions, const JobPlan& plan) {
  const double weight = plan.anchor_weight;
  if (weight == 0) return {};
  auto anchors = executor.template allocate<Anchor>(around.node_count);
  Anchor* const out = anchors.data();
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const Vec3d home = vec3_cast<double>(positions[node]);
    double sum = 0;
    for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
      const Vec3d edge = vec3_cast<double>(positions[*n]) - home;
      sum += dot(edge, edge);
    }
    const auto count = static_cast<double>(around.rings.size(node));
    out[node] = {home, sum > 0 ? weight * count / sum : 0};
  });
  return anchors;
}

}  // namespace meshsmooth::detail
