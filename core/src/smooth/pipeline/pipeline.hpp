#pragma once

#include <optional>
#include <utility>

#include "smooth/averaging/deviations.hpp"
#include "smooth/averaging/only_below.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/base/job_arrays.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/fit/constrain_to_surface.hpp"
#include "smooth/fit/measure_fit.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/pipeline/iterate.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Waits for all work of a job, and completes its summary.
template <Executor E>
void end_job(E& executor, const SmoothOptions& options, const StageTimes& times,
             SmoothSummary& summary) {
  executor.finish();
  if (options.quality_detail == QualityDetail::brief) {
    summary.quality_before.metrics.clear();
    summary.quality_after.metrics.clear();
  }
  summary.times = times;
}

/// neighbours -> boundary -> constraints -> iterate -> evaluate, and what is worse back -> write
/// back, in this order and timed, as planned: the one text of every backend. The stages that it
/// enters are those of `MemoryPlan`.
///
/// takes  a mesh whose sizes are valid, the arrays in host memory; what the backend has not had
///        validated, `prepare` finds
/// gives  smoothed positions in the array of the result, and the summary
template <Backend B, class Real>
SmoothSummary run_pipeline(B& backend, const TopologyView& topology, const JobArrays<Real>& arrays,
                           const JobPlan& plan, const JobControl& control) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  refuse_too_large(topology);
  const SmoothOptions& options = plan.options;
  const auto enter = [&](JobStage stage) { executor.bytes().enter(stage); };
  StageTimes times;
  auto job = backend.prepare(topology, arrays.given, plan, control, times);
  if (!topology.canonical && options.boundary != BoundaryPolicy::fixed) {
    enter(JobStage::find_coincident);
    const typename E::Timer timer(executor, times.find_boundary_seconds);
    if (may_have_coincident_nodes(executor, job)) throw NotCanonical{};
  }
  enter(JobStage::find_reference);
  TargetArrays<E> targets = find_reference(executor, job, plan, arrays.input.reference);
  enter(JobStage::measure_input);
  typename B::Orientation orientation;
  {
    const typename E::Timer timer(executor, times.evaluate_seconds);
    orientation = backend.orient(job);
  }
  // A plane surface has no normals of its elements.
  const bool surface = orientation.references() != nullptr && plan.stays_on_surface;
  if (surface && plan.moves) refuse_moving_surface();
  SmoothSummary summary;
  std::optional<TargetSurface> target_surface;
  enter(JobStage::constrain);
  Constraints<E> constraints;
  if (arrays.input.surface != nullptr || constrains(topology, options, surface)) {
    const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
    constraints =
        arrays.input.surface != nullptr
            ? constrain_to_surface(executor, topology, *arrays.input.surface, options.feature_angle,
                                   job, target_surface, summary.fit.emplace())
            : constrain(executor, topology, options, surface, targets.view.reference, job);
  }
  enter(JobStage::measure_input);
  summary.flat_reference_element_count = targets.flat;

  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    const auto evaluate = [&] { return backend.evaluate(job, orientation); };
    summary.quality_before =
        backend.kept_reference() != nullptr
            ? backend.kept_reference()->quality(options.quality_detail, evaluate)
            : evaluate();
    const QualityStats& before = summary.quality_before;
    // On a curved surface no element is inverted against its own normal; its neighbours tell.
    const bool curved =
        orientation.references() != nullptr && (plan.stays_on_surface || plan.needs_balls);
    const bool plain = before.inverted_count + before.degenerate_count == 0 && !curved;
    if (!topology.canonical && !plain && may_not_be_canonical(executor, job, orientation)) {
      throw NotCanonical{};
    }
    refuse_tangled(summary.quality_before, plan.tangled);
    if (plan.moves) refuse_tangled_reference(summary.quality_before);
  }
  const auto surroundings = [&] {
    Surroundings around{job.node_count,      job.elements.view, job.rings.view(),
                        job.balls.view(),    job.fixed.data(),  orientation.references(),
                        orientation.common()};
    around.sliding = constraints.view();
    return around;
  };
  if (plan.derivative != Derivative::none) {
    summary.nodes = job.nodes;
    {
      const StageTimer timer(executor, times.iterate_seconds, control, Stage::iterate);
      enter(JobStage::iterate);
      differentiate(backend, surroundings(), plan, job, arrays, summary.motion.emplace());
    }
    summary.quality_after = summary.quality_before;  // the mesh stays
    end_job(executor, options, times, summary);
    return summary;
  }
  {
    const StageTimer timer(executor, times.iterate_seconds, control, Stage::iterate);
    Surroundings around = surroundings();
    if (plan.aim == Aim::boxes) {
      enter(JobStage::find_boxes);
      find_boxes(executor, around, job.positions.data(), simplex_count(topology), targets);
    }
    around.targets = targets.view;
    enter(JobStage::find_anchors);
    const auto anchors = find_anchors(executor, around, job.positions.data(), plan);
    around.anchors = anchors.data();
    enter(JobStage::fix_outside);
    if (options.only_below) fix_outside(executor, around, *options.only_below, job);
    summary.nodes = job.nodes;
    Colouring<E> colouring;  // `Motion` finds its own, unless it makes no sweep
    if (plan.colours && !plan.moves) {
      enter(JobStage::colour);
      colouring = backend.colour(around, job.caller_ids.data());
    }
    if (!plan.needs_balls) job.balls = {};
    enter(JobStage::iterate);
    ConvergenceMonitor monitor(plan, control, job.box.diagonal(), job.free_count);
    std::optional<MotionTask> motion;
    if (plan.moves) motion.emplace(MotionTask{arrays.input.prescribed, summary.motion.emplace()});
    std::optional<FitTask> fit;
    if (summary.fit) {
      fit.emplace(FitTask{constraints.node_constraints.data(), constraints.tolerance,
                          job.box.diagonal(), *summary.fit});
    }
    iterate(backend, around, colouring, monitor, job, {motion, fit});
    summary.colour_count = static_cast<int>(colouring.count());
    summary.stop_reason = monitor.reason();
    summary.convergence = monitor.take();
    summary.poor = monitor.poor();
  }
  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    enter(JobStage::measure_result);
    QualityReport report = backend.evaluate_result(job, orientation);
    if (plan.keeps_quality && !(summary.fit && summary.fit->input_off_surface)) {
      KeptQuality& kept =
          summary.kept_quality.emplace(KeptQuality{metric_in_force(topology, plan)});
      if (may_be_worse(summary.quality_before, report.quality, report.locked, plan, kept.metric)) {
        if (!summary.poor) job.rings = {};  // its memory serves the step
        enter(JobStage::keep_quality);
        keep_quality(executor, surroundings(), plan, job, kept);
        enter(JobStage::measure_result);
        if (kept.restored_node_count() > 0) {
          report = backend.evaluate_result(job, orientation);
          if (summary.poor) {
            Surroundings around = surroundings();
            around.targets = targets.view;
            enter(JobStage::recount_poor);
            summary.poor = recount_poor(backend, around, plan, control, job);
            enter(JobStage::measure_result);
          }
        }
      }
    }
    summary.quality_after = std::move(report.quality);
    summary.locked = std::move(report.locked);
    if (summary.fit) {
      measure_fit(executor, *target_surface, constraints, job, *summary.fit);
    } else if (constraints.curved) {
      summary.deviation = measure_deviations(executor, job.node_count, constraints.view(),
                                             constraints.tolerance, job.positions.data());
    }
    if (!options.element_quality_metrics.empty()) {
      summary.element_quality =
          backend.evaluate_elements(job, orientation, options.element_quality_metrics);
    }
  }
  const std::int64_t* moved = nullptr;  // known when all work is finished
  {
    const typename E::Timer timer(executor, times.download_seconds);
    moved = backend.write_back(job, arrays.result);
  }
  end_job(executor, options, times, summary);
  summary.nodes.moved = *moved;
  return summary;
}

}  // namespace meshsmooth::detail
