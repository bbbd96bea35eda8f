#include "summary_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "boundary_report.hpp"
#include "locked_elements.hpp"
#include "quality_report.hpp"
#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

/// What the last sweep came to, beside what would have ended the job.
std::string last_sweep(const Convergence& convergence, const SmoothOptions& options) {
  const bool by_energy = converges_by_energy(options);
  std::string text =
      fmt::format("largest move {:.3g}, {} {:.3g}", convergence.last_max_displacement,
                  by_energy ? "energy tolerance" : "tolerance",
                  by_energy ? options.tolerance.value : convergence.tolerance);
  if (convergence.remaining_gain) {
    text += fmt::format(", about {:.2g} % of the energy left to gain",
                        100 * *convergence.remaining_gain);
  }
  return text;
}

const char* standstill(EndRule rule) {
  switch (rule) {
    case EndRule::no_progress:
      return "tangled elements do not become better, or moves no longer shrink";
    case EndRule::all_held:
      return "every move was rejected";
    default:
      return "no node moves any more for the better";
  }
}

std::string stop_sentence(const SmoothSummary& summary, const SmoothOptions& options) {
  const Convergence& convergence = summary.convergence;
  const std::string after = "after " + counted(convergence.iteration_count, "iteration");
  const std::string move = last_sweep(convergence, options);
  switch (summary.stop_reason) {
    case StopReason::converged:
      return fmt::format("converged {} ({})", after, move);
    case StopReason::target_reached:
      return fmt::format("reached the target quality {}", after);
    case StopReason::iteration_limit:
      if (convergence.iteration_count == 0) return "evaluated only: no iteration was allowed";
      return fmt::format("stopped {} at the limit, not converged ({})", after, move);
    case StopReason::compute_budget:
      return fmt::format("stopped {} when the compute budget was used up ({})", after, move);
    case StopReason::stagnated:
      return fmt::format("stagnated {}: {} ({})", after, standstill(convergence.end_rule), move);
    case StopReason::cancelled_with_result:
      return fmt::format("cancelled {}; this is the result reached by then ({})", after, move);
  }
  return {};
}

const MetricStats* find_metric(const QualityStats& stats, QualityMetric metric) {
  const auto found = std::ranges::find(stats.metrics, metric, &MetricStats::metric);
  return found == stats.metrics.end() || found->element_count == 0 ? nullptr : &*found;
}

struct Row {
  QualityMetric metric;
  const char* label;
  double MetricStats::*value;
  const char* format;
};

std::string quality_table(const SmoothSummary& summary) {
  using enum QualityMetric;
  static constexpr const char* kRatio = "  {:<24} {:>10.4f} {:>10.4f}\n";
  static constexpr const char* kAngle = "  {:<24} {:>10.2f} {:>10.2f}\n";
  static constexpr Row kRows[] = {
      {mean_ratio, "mean ratio       min", &MetricStats::min, kRatio},
      {mean_ratio, "                 1 %", &MetricStats::percentile_1, kRatio},
      {mean_ratio, "                 mean", &MetricStats::mean, kRatio},
      {scaled_jacobian, "scaled jacobian  min", &MetricStats::min, kRatio},
      {scaled_jacobian, "                 1 %", &MetricStats::percentile_1, kRatio},
      {scaled_jacobian, "                 mean", &MetricStats::mean, kRatio},
      {radius_ratio, "radius ratio     min", &MetricStats::min, kRatio},
      {radius_ratio, "                 1 %", &MetricStats::percentile_1, kRatio},
      {radius_ratio, "                 mean", &MetricStats::mean, kRatio},
      {min_dihedral_angle, "dihedral angle   min", &MetricStats::min, kAngle},
      {max_dihedral_angle, "                 max", &MetricStats::max, kAngle},
      {min_angle, "angle            min", &MetricStats::min, kAngle},
      {max_angle, "                 max", &MetricStats::max, kAngle}};
  std::string text = fmt::format("  {:<24} {:>10} {:>10}\n", "quality", "before", "after");
  for (const Row& row : kRows) {
    const MetricStats* before = find_metric(summary.quality_before, row.metric);
    const MetricStats* after = find_metric(summary.quality_after, row.metric);
    if (before == nullptr || after == nullptr) continue;
    text += fmt::format(fmt::runtime(row.format), row.label, before->*row.value, after->*row.value);
  }
  return text;
}

/// How the mean ratios were and are spread.
std::string histograms(const SmoothSummary& summary) {
  std::string text;
  const char* label = "mean ratio       before";
  for (const QualityStats* stats : {&summary.quality_before, &summary.quality_after}) {
    if (const MetricStats* m = find_metric(*stats, QualityMetric::mean_ratio)) {
      text += fmt::format("  {:<24} {:g} |{}| {:g}\n", label, m->histogram_lower,
                          draw_histogram(m->histogram), m->histogram_upper);
    }
    label = "                 after";
  }
  return text;
}

std::string poor_sentence(const std::optional<PoorElements>& poor) {
  if (!poor) return {};
  const std::int64_t rest = poor->element_count - poor->locked_count - poor->limited_count;
  return fmt::format(
      "{} below a mean ratio of {:.4g}: {} locked, {} limited by connectivity, {} could still "
      "become better\n",
      counted(poor->element_count, "element"), poor->below, with_commas(poor->locked_count),
      with_commas(poor->limited_count), with_commas(rest));
}

std::string motion_sentence(const std::optional<MotionStats>& motion,
                            const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  if (!motion) return {};
  std::string text =
      fmt::format("reached {:.4g} % of the motion in {}{}\n", 100 * motion->reached,
                  counted(motion->step_count, "step"),
                  motion->rejected_step_count > 0
                      ? fmt::format(" ({} more rejected)", motion->rejected_step_count)
                      : "");
  if (motion->reached == 1) return text;
  text += fmt::format("a step further {} would be inverted",
                      counted(motion->blocking_element_count, "element"));
  for (std::size_t n = 0; n < motion->blocking_elements.size(); ++n) {
    text +=
        fmt::format("{}{}", n == 0 ? ": " : ", ", file_element_id(motion->blocking_elements[n]));
  }
  return text + "\n";
}

std::string nodes_sentence(const SmoothSummary& summary, const SmoothOptions& options) {
  const NodeCounts& nodes = summary.nodes;
  std::string text =
      fmt::format("{}: {} moved, {} fixed ({} on the boundary)", counted(nodes.total, "node"),
                  with_commas(nodes.moved), with_commas(nodes.fixed), with_commas(nodes.boundary));
  if (options.boundary == BoundaryPolicy::slide) {
    text += fmt::format(", {} slide in their plane and {} along their crease",
                        with_commas(nodes.sliding_in_plane), with_commas(nodes.sliding_on_line));
    if (nodes.sliding_on_surface + nodes.sliding_on_curve > 0) {
      text +=
          fmt::format(", {} on their curved part and {} along their curve",
                      with_commas(nodes.sliding_on_surface), with_commas(nodes.sliding_on_curve));
    }
    if (nodes.curved > 0)
      text += fmt::format(", {} on curved parts stay", with_commas(nodes.curved));
  }
  if (nodes.coincident > 0) {
    text += fmt::format(", {} on the boundary share their positions and stay",
                        with_commas(nodes.coincident));
  }
  if (nodes.paired > 0) {
    text += fmt::format(", {} in pairs stay", with_commas(nodes.paired));
  }
  if (nodes.on_non_manifold_edges > 0) {
    text += fmt::format(", {} on non-manifold edges (of three or more elements)",
                        with_commas(nodes.on_non_manifold_edges));
  }
  if (nodes.isolated > 0) text += fmt::format(", {} in no element", with_commas(nodes.isolated));
  if (summary.convergence.held_node_count > 0) {
    text += fmt::format("; the guard{} held {} back in the last sweep",
                        options.movement_limit ? " or the movement limit" : "",
                        with_commas(summary.convergence.held_node_count));
  }
  return text + "\n";
}

std::string times_sentence(const client::SmoothReport& report, double total_seconds) {
  const StageTimes& times = report.summary.times;
  const std::pair<const char*, double> stages[] = {{"receive", report.receive_seconds},
                                                   {"queue", report.queue_seconds},
                                                   {"upload", times.upload_seconds},
                                                   {"neighbours", times.find_neighbours_seconds},
                                                   {"boundary", times.find_boundary_seconds},
                                                   {"iterate", times.iterate_seconds},
                                                   {"evaluate", times.evaluate_seconds},
                                                   {"download", times.download_seconds},
                                                   {"send", report.send_seconds}};
  std::string text = "time " + duration(total_seconds) + ": ";
  const char* separator = "";
  for (const auto& [name, seconds] : stages) {
    if (seconds <= 0) continue;
    text += fmt::format("{}{} {}", separator, name, duration(seconds));
    separator = ", ";
  }
  text += fmt::format(" ({}", report.summary.backend);
  if (report.summary.thread_count > 0) {
    text += ", " + counted(report.summary.thread_count, "thread");
  }
  return text + ")\n";
}

/// What the mesh is like now, and what it took.
std::string state_sentences(const client::SmoothReport& report, const SmoothOptions& options,
                            double total_seconds,
                            const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  const SmoothSummary& summary = report.summary;
  std::string text = describe_inverted(summary, options) + "\n";
  if (const std::int64_t degenerate = summary.quality_after.degenerate_count; degenerate > 0) {
    text += fmt::format("{} {} degenerate (no volume that double precision can tell from 0)\n",
                        counted(degenerate, "element"), degenerate == 1 ? "is" : "are");
  }
  return text + describe_reading(summary.quality_before, file_element_id) +
         describe_kept_quality(summary) + describe_volume(summary.quality_after) +
         describe_locked(summary.locked, file_element_id) + poor_sentence(summary.poor) +
         nodes_sentence(summary, options) + describe_deviation(summary) +
         describe_fit(summary.fit) + times_sentence(report, total_seconds);
}

std::string cause_of_inversion(const SmoothOptions& options) {
  if (options.guard) return {};
  std::string method(method_name(options.method));
  std::ranges::replace(method, '_', '-');
  if (method == "laplacian") method = "plain laplacian";
  return ": " + method + " without the guard does this";
}

}  // namespace

std::string describe_inverted(const SmoothSummary& summary, const SmoothOptions& options) {
  const std::int64_t total = summary.quality_after.element_count;
  const std::int64_t before = summary.quality_before.inverted_count;
  const std::int64_t after = summary.quality_after.inverted_count;
  if (after == 0 && before == 0) return "no element is inverted";
  if (after == 0) {
    return fmt::format("no element is inverted any more; {} {} before", with_commas(before),
                       before == 1 ? "was" : "were");
  }
  std::string text =
      fmt::format("{} of {} ({}) {} inverted", with_commas(after), counted(total, "element"),
                  percentage(after, total), after == 1 ? "is" : "are");
  if (before == 0) return text + "; they were valid before" + cause_of_inversion(options);
  text += fmt::format("; {} {} before", with_commas(before), before == 1 ? "was" : "were");
  if (summary.locked.inverted_count > 0) {
    text += fmt::format("; {} of them locked by fixed nodes",
                        with_commas(summary.locked.inverted_count));
  }
  return text;
}

std::string describe_summary(const client::SmoothReport& report, const SmoothOptions& options,
                             double total_seconds,
                             const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  const SmoothSummary& summary = report.summary;
  return motion_sentence(summary.motion, file_element_id) + stop_sentence(summary, options) + "\n" +
         quality_table(summary) + histograms(summary) +
         state_sentences(report, options, total_seconds, file_element_id);
}

std::string describe_findings(const client::SmoothReport& report, const SmoothOptions& options,
                              double total_seconds,
                              const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  const SmoothSummary& summary = report.summary;
  return motion_sentence(summary.motion, file_element_id) + stop_sentence(summary, options) + "\n" +
         state_sentences(report, options, total_seconds, file_element_id);
}

}  // namespace meshsmooth::cli
