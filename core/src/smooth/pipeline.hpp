#pragma once

#include <chrono>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "smooth/iterate.hpp"
#include "smooth/job_topology.hpp"

namespace meshsmooth::detail {

/// Adds the time between its making and its end to a field of `StageTimes`, and
/// tells the watcher that the stage has begun.
class StageTimer {
 public:
  StageTimer(double& seconds, const JobControl& control, Stage stage) : seconds_(seconds) {
    if (control.on_progress) control.on_progress({stage, 0, 0, 0});
  }
  ~StageTimer() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

/// Host views of a job's elements in internal order.
template <Executor E>
std::vector<ElementBlockView> block_views(const JobElements<E>& elements) {
  std::vector<ElementBlockView> blocks;
  for (int r = 0; r < elements.view.run_count; ++r) {
    const Elements::Run& run = elements.view.runs[r];
    const std::size_t end =
        r + 1 < elements.view.run_count ? elements.view.runs[r + 1].first : elements.view.count;
    const auto type = static_cast<ElementType>(run.shape - elements.shapes.data());
    blocks.push_back(
        {type, {run.nodes, (end - run.first) * static_cast<std::size_t>(run.shape->node_count)}});
  }
  return blocks;
}

/// Ids inside a job are 32-bit.
inline void refuse_too_large(const TopologyView& topology) {
  if (topology.node_count > std::numeric_limits<NodeId>::max()) {
    throw NotSupported("MESH_TOO_LARGE", "a mesh has at most 2147483647 nodes, this one has " +
                                             std::to_string(topology.node_count));
  }
  if (topology.element_count() > std::numeric_limits<ElementId>::max()) {
    throw NotSupported("MESH_TOO_LARGE", "a mesh has at most 4294967295 elements, this one has " +
                                             std::to_string(topology.element_count()));
  }
}

[[noreturn]] inline void throw_node_order(const QualityStats& quality) {
  throw InvalidMesh(
      "ALL_ELEMENTS_INVERTED",
      "all " + std::to_string(quality.element_count) +
          " elements are inverted: the nodes of an element are in the other orientation; use "
          "VTK's node order (swap two nodes of every element)",
      {{"inverted_element_count", std::to_string(quality.inverted_count)}});
}

inline void refuse_tangled(const QualityStats& quality, TangledPolicy policy, bool volume) {
  if (quality.inverted_count == 0) return;
  if (volume && quality.inverted_count == quality.element_count) throw_node_order(quality);
  if (policy == TangledPolicy::refuse) {
    const std::string element = std::to_string(quality.worst.front().element);
    throw InvalidMesh(
        "MESH_TANGLED",
        std::to_string(quality.inverted_count) + " of " + std::to_string(quality.element_count) +
            " elements are inverted, the worst is element " + element +
            "; allow repair, or mend the mesh first",
        {{"inverted_element_count", std::to_string(quality.inverted_count)}, {"element", element}});
  }
}

/// neighbours -> boundary -> iterate, in this order and timed: the one text of
/// every backend. `Judge` is the backend's way to the quality measures and back
/// to the caller's positions.
///
/// takes  a mesh that passed `validate`, the caller's positions in host memory
/// gives  smoothed positions in `positions` (free nodes only) and the summary
template <Executor E, class Real, class Judge>
SmoothSummary run_pipeline(E& executor, const TopologyView& topology,
                           std::span<Vec3<Real>> positions, const SmoothOptions& options,
                           const JobControl& control, const Judge& judge) {
  refuse_too_large(topology);
  const std::size_t node_count = topology.node_count;
  SmoothSummary summary;
  StageTimes& times = summary.times;

  Renumbering<E> renumbering;
  JobElements<E> elements;
  RowBuffer<E, ElementId> balls;
  RowBuffer<E, NodeId> rings;
  auto place_buffer = executor.template allocate<Vec3<Real>>(node_count);
  Vec3<Real>* const places = place_buffer.data();
  Box box;
  {
    const StageTimer timer(times.find_neighbours_seconds, control, Stage::find_neighbours);
    auto given = executor.in_executor_memory(std::span<const Vec3<Real>>(positions));
    box = find_box(executor, given.data(), node_count);
    renumbering = renumber_nodes(executor, given.data(), node_count, box);
    const NodeId* const caller_of = renumbering.caller_of.data();
    const Vec3<Real>* const source = given.data();
    executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      places[node] = source[caller_of[node]];
    });
    elements = renumber_elements(executor, topology, renumbering.internal_of.data());
    renumbering.internal_of = {};
    balls = find_balls(executor, node_count, elements.view, elements.caller_of.data());
    rings = find_rings(executor, node_count, elements.view, balls.view(), caller_of);
  }

  auto fixed_buffer = executor.template allocate<std::uint8_t>(node_count);
  std::uint8_t* const fixed = fixed_buffer.data();
  {
    const StageTimer timer(times.find_boundary_seconds, control, Stage::find_boundary);
    const NodeId* const caller_of = renumbering.caller_of.data();
    find_boundary(executor, node_count, elements.view, balls.view(), caller_of,
                  elements.caller_of.data(), fixed);
    auto given = executor.in_executor_memory(topology.fixed);
    const std::uint8_t* const mask = topology.fixed.empty() ? nullptr : given.data();
    const bool boundary_fixed = options.boundary == BoundaryPolicy::fixed;
    const Rows<ElementId> ball_rows = balls.view();
    summary.nodes = executor.reduce(
        node_count, NodeCounts{},
        [=] MESHSMOOTH_HD(std::size_t node) {
          const bool boundary = fixed[node] != 0;
          const bool by_caller = mask != nullptr && mask[caller_of[node]] != 0;
          const bool isolated = ball_rows.size(node) == 0;
          const bool held = (boundary && boundary_fixed) || by_caller;
          fixed[node] = held || isolated ? 1 : 0;
          return NodeCounts{1, boundary ? 1 : 0, held ? 1 : 0, isolated ? 1 : 0, 0};
        },
        [] MESHSMOOTH_HD(const NodeCounts& a, const NodeCounts& b) {
          return NodeCounts{a.total + b.total, a.boundary + b.boundary, a.fixed + b.fixed,
                            a.isolated + b.isolated, 0};
        });
  }

  const bool volume = elements.view.runs[0].shape->dimension == 3;
  typename Judge::Orientation orientation;
  {
    const StageTimer timer(times.judge_seconds, control, Stage::judge);
    orientation = judge.orientation(elements, places, node_count);
    summary.quality_before = judge.quality(elements, places, node_count, orientation);
    refuse_tangled(summary.quality_before, options.tangled, volume);
  }

  const std::size_t free_count = executor.reduce(
      node_count, std::size_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::size_t { return fixed[node] == 0 ? 1 : 0; },
      [] MESHSMOOTH_HD(std::size_t a, std::size_t b) { return a + b; });
  {
    const StageTimer timer(times.iterate_seconds, control, Stage::iterate);
    Surroundings around{node_count,          elements.view, rings.view(),
                        balls.view(),        fixed,         orientation.references(),
                        orientation.common()};
    Colouring<E> colouring;
    if (resolve_form(options) == Form::gauss_seidel) {
      colouring = colour_nodes(executor, around, renumbering.caller_of.data());
      summary.colour_count = static_cast<int>(colouring.count());
    }
    if (!needs_balls(options)) balls = {};
    ConvergenceWatch watch(options, control, box.diagonal(), free_count);
    iterate(executor, around, colouring, options, watch, places);
    summary.stop_reason = watch.reason();
    summary.convergence = watch.take();
  }
  {
    const StageTimer timer(times.judge_seconds, control, Stage::judge);
    summary.quality_after = judge.quality(elements, places, node_count, orientation);
    summary.locked = judge.locked(elements, places, node_count, orientation, fixed);
  }
  {
    const StageTimer timer(times.download_seconds, control, Stage::judge);
    summary.nodes.moved = judge.write_back(renumbering.caller_of.data(), fixed, places, positions);
  }
  return summary;
}

}  // namespace meshsmooth::detail
