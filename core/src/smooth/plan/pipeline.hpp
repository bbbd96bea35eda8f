#pragma once

#include <optional>
#include <span>
#include <utility>

#include "smooth/averaging/deviations.hpp"
#include "smooth/averaging/only_below.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/fit/constrain_to_surface.hpp"
#include "smooth/fit/measure_fit.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/plan/iterate.hpp"
#include "smooth/plan/needs_balls.hpp"

namespace meshsmooth::detail {

/// neighbours -> boundary -> constraints -> iterate -> evaluate, and what is worse back -> write
/// back, in this order and timed: the one text of every backend.
///
/// takes  a mesh whose sizes are valid, the given positions in host memory; what the backend has
///        not had validated, `prepare` finds
/// gives  smoothed positions in `positions`, which may be the array given, and the summary
template <Backend B, class Real>
SmoothSummary run_pipeline(B& backend, const TopologyView& topology,
                           std::span<const Vec3<Real>> given, std::span<Vec3<Real>> positions,
                           const SmoothOptions& options, const JobControl& control) {
  using E = typename B::Executor;
  E& executor = backend.executor();
  refuse_too_large(topology);
  const SmoothOptions sweeping = sweeping_options(options);
  const bool moves = std::holds_alternative<Move>(options.method);
  StageTimes times;
  auto job = backend.prepare(topology, given, sweeping, control, times);
  if (!topology.canonical && sweeping.boundary != BoundaryPolicy::fixed) {
    const typename E::Timer timer(executor, times.find_boundary_seconds);
    if (may_have_coincident_nodes(executor, job)) throw NotCanonical{};
  }
  TargetArrays<E> targets = find_reference(executor, job, sweeping);
  typename B::Orientation orientation;
  {
    const typename E::Timer timer(executor, times.evaluate_seconds);
    orientation = backend.orient(job);
  }
  // A plane surface has no normals of its elements.
  const bool surface = orientation.references() != nullptr && stays_on_surface(sweeping);
  if (surface && moves) refuse_moving_surface();
  SmoothSummary summary;
  std::optional<TargetSurface> target_surface;
  if (options.surface != nullptr) summary.fit.emplace();
  Constraints<E> constraints = summary.fit
                                   ? constrain_to_surface(executor, topology, options, control, job,
                                                          times, target_surface, *summary.fit)
                                   : constrain(executor, topology, sweeping, surface, control,
                                               targets.view.reference, job, times);
  summary.flat_reference_element_count = targets.flat;

  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    const auto evaluate = [&] { return backend.evaluate(job, orientation); };
    summary.quality_before =
        backend.kept_reference() != nullptr
            ? backend.kept_reference()->quality(options.quality_detail, evaluate)
            : evaluate();
    const QualityStats& before = summary.quality_before;
    const bool plain = before.inverted_count + before.degenerate_count == 0 && !surface;
    if (!topology.canonical && !plain && may_not_be_canonical(executor, job, orientation)) {
      throw NotCanonical{};
    }
    refuse_tangled(summary.quality_before, sweeping.tangled);
    if (moves) refuse_tangled_reference(summary.quality_before);
  }
  const auto surroundings = [&] {
    Surroundings around{job.node_count,      job.elements.view, job.rings.view(),
                        job.balls.view(),    job.fixed.data(),  orientation.references(),
                        orientation.common()};
    around.sliding = constraints.view();
    return around;
  };
  {
    const StageTimer timer(executor, times.iterate_seconds, control, Stage::iterate);
    Surroundings around = surroundings();
    if (has_boxes(sweeping)) {
      find_boxes(executor, around, job.positions.data(), simplex_count(topology), targets);
    }
    around.targets = targets.view;
    const auto anchors = find_anchors(executor, around, job.positions.data(), sweeping);
    around.anchors = anchors.data();
    if (options.only_below) fix_outside(executor, around, *options.only_below, job);
    summary.nodes = job.nodes;
    Colouring<E> colouring;  // `Motion` finds its own, unless it makes no sweep
    if (resolve_form(sweeping) == Form::gauss_seidel && !moves) {
      colouring = backend.colour(around, job.caller_ids.data());
    }
    if (!needs_balls(sweeping)) job.balls = {};
    ConvergenceMonitor monitor(sweeping, control, job.box.diagonal(), job.free_count);
    if (moves) summary.motion.emplace();
    iterate(backend, around, colouring, options, monitor, job,
            {moves ? &*summary.motion : nullptr, summary.fit ? &*summary.fit : nullptr,
             constraints.node_constraints.data()});
    summary.colour_count = static_cast<int>(colouring.count());
    summary.stop_reason = monitor.reason();
    summary.convergence = monitor.take();
    summary.poor = monitor.poor();
  }
  {
    const StageTimer timer(executor, times.evaluate_seconds, control, Stage::evaluate);
    QualityReport report = backend.evaluate_result(job, orientation);
    if (keeps_quality(sweeping) && !(summary.fit && summary.fit->input_off_surface)) {
      KeptQuality& kept =
          summary.kept_quality.emplace(KeptQuality{metric_in_force(topology, options)});
      if (may_be_worse(summary.quality_before, report.quality, report.locked, options,
                       kept.metric)) {
        if (!summary.poor) job.rings = {};  // its memory serves the step
        keep_quality(executor, surroundings(), options, job, kept);
        if (kept.restored_node_count() > 0) {
          report = backend.evaluate_result(job, orientation);
          if (summary.poor) {
            Surroundings around = surroundings();
            around.targets = targets.view;
            summary.poor = recount_poor(backend, around, sweeping, control, job);
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
    moved = backend.write_back(job, positions);
  }
  executor.finish();
  if (options.quality_detail == QualityDetail::brief) {
    summary.quality_before.metrics.clear();
    summary.quality_after.metrics.clear();
  }
  summary.nodes.moved = *moved;
  summary.times = times;
  return summary;
}

}  // namespace meshsmooth::detail
