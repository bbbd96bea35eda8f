#pragma once

#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "smooth/constraints/constraints.hpp"
#include "smooth/steps/iterate.hpp"
#include "smooth/steps/job_mesh.hpp"

namespace meshsmooth::detail {

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

/// constraints -> iterate, of a job that is prepared. Adds to `times`, which has what
/// preparing took: some backends know it at the end only.
template <Executor E, class Real, class Judge>
SmoothSummary run_prepared(E& executor, const TopologyView& topology, JobMesh<E, Real> job,
                           std::span<Vec3<Real>> positions, const SmoothOptions& options,
                           const JobControl& control, Judge&& judge, StageTimes& times) {
  SmoothSummary summary;
  const Constraints<E> constraints = constrain(executor, topology, options, control, job, times);
  summary.nodes = job.nodes;

  typename std::decay_t<Judge>::Orientation orientation;
  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    orientation = judge.orientation(job);
    summary.quality_before = judge.quality(job, orientation);
    refuse_tangled(summary.quality_before, options.tangled, job.volume());
  }
  {
    const StageTimer timer(executor, times.iterate_seconds, control, Stage::iterate);
    Surroundings around{job.node_count,      job.elements.view, job.rings.view(),
                        job.balls.view(),    job.fixed.data(),  orientation.references(),
                        orientation.common()};
    around.sliding = constraints.view();
    Colouring<E> colouring;
    if (resolve_form(options) == Form::gauss_seidel) {
      colouring = colour_nodes(executor, around, job.caller_ids.data());
      summary.colour_count = static_cast<int>(colouring.count());
    }
    if (!needs_balls(options)) job.balls = {};
    ConvergenceMonitor watch(options, control, job.box.diagonal(), job.free_count);
    iterate(executor, around, colouring, options, watch,
            CallerPositions<Real>{job.given.data(), job.caller_ids.data()}, job.places.data());
    summary.stop_reason = watch.reason();
    summary.convergence = watch.take();
  }
  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    Verdict verdict = judge.verdict(job, orientation);
    summary.quality_after = std::move(verdict.quality);
    summary.locked = std::move(verdict.locked);
    if (constraints.curved) {
      const OneSidedDeviations strayed = measure_deviations(
          executor, job.node_count, constraints.view(), constraints.tolerance, job.places.data());
      summary.deviation = {constraints.tolerance, strayed.off_facets, strayed.cut_off};
    }
  }
  const std::int64_t* moved = nullptr;  // known when all is finished
  {
    const StageTimer timer(executor, times.download_seconds, control, Stage::evaluate);
    moved = judge.write_back(job, positions);
  }
  executor.finish();
  summary.nodes.moved = *moved;
  summary.times = times;
  return summary;
}

/// neighbours -> boundary -> constraints -> iterate, in this order and timed: the one text of
/// every backend. `Judge` is the backend's way to the quality measures and back
/// to the caller's positions.
///
/// takes  a mesh whose sizes are valid, the caller's positions in host memory;
///        what the backend has not had validated, `prepare_job` finds
/// gives  smoothed positions in `positions` (free nodes only) and the summary
template <Executor E, class Real, class Judge>
SmoothSummary run_pipeline(E& executor, const TopologyView& topology,
                           std::span<Vec3<Real>> positions, const SmoothOptions& options,
                           const JobControl& control, Judge&& judge) {
  refuse_too_large(topology);
  StageTimes times;
  JobMesh<E, Real> job = prepare_job(executor, topology, std::span<const Vec3<Real>>(positions),
                                     options, control, times);
  return run_prepared(executor, topology, std::move(job), positions, options, control, judge,
                      times);
}

}  // namespace meshsmooth::detail
