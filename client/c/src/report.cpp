#include <algorithm>
#include <cstdint>
#include <limits>

#include "error.hpp"
#include "handles.hpp"
#include "structures.hpp"

using namespace meshsmooth::c;
using meshsmooth::MetricStats;
using meshsmooth::QualityMetric;
using meshsmooth::QualityStats;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A figure of a metric; NaN where no element has it or it was not evaluated.
double figure(const QualityStats& quality, QualityMetric metric, double MetricStats::*member) {
  const auto found = std::ranges::find(quality.metrics, metric, &MetricStats::metric);
  return found != quality.metrics.end() && found->element_count > 0 ? (*found).*member : kNone;
}

meshsmooth_summary summarize(const meshsmooth::client::SmoothReport& report) {
  const meshsmooth::SmoothSummary& job = report.summary;
  const QualityStats& before = job.quality_before;
  const QualityStats& after = job.quality_after;
  using enum QualityMetric;
  return {
      .size = sizeof(meshsmooth_summary),
      .stop_reason = static_cast<int64_t>(job.stop_reason) + 1,  // 0 on the wire is none
      .end_rule = static_cast<int64_t>(job.convergence.end_rule),
      .iteration_count = job.convergence.iteration_count,
      .node_count = job.nodes.total,
      .boundary_node_count = job.nodes.boundary,
      .fixed_node_count = job.nodes.fixed,
      .moved_node_count = job.nodes.moved,
      .restored_node_count = job.kept_quality ? job.kept_quality->restored_node_count() : 0,
      .element_count = after.element_count,
      .locked_element_count = job.locked.element_count,
      .inverted_count_before = before.inverted_count,
      .inverted_count_after = after.inverted_count,
      .degenerate_count_before = before.degenerate_count,
      .degenerate_count_after = after.degenerate_count,
      .min_mean_ratio_before = figure(before, mean_ratio, &MetricStats::min),
      .min_mean_ratio_after = figure(after, mean_ratio, &MetricStats::min),
      .mean_mean_ratio_before = figure(before, mean_ratio, &MetricStats::mean),
      .mean_mean_ratio_after = figure(after, mean_ratio, &MetricStats::mean),
      .min_scaled_jacobian_before = figure(before, scaled_jacobian, &MetricStats::min),
      .min_scaled_jacobian_after = figure(after, scaled_jacobian, &MetricStats::min),
      .motion_reached = job.motion ? job.motion->reached : kNone,
      .queue_seconds = report.queue_seconds,
      .topology_reused = report.topology_reused,
      .shared_memory = report.shared_memory,
  };
}

static_assert(MESHSMOOTH_STOP_REASON_CONVERGED ==
              static_cast<int>(meshsmooth::StopReason::converged) + 1);
static_assert(MESHSMOOTH_END_RULE_NONE == static_cast<int>(meshsmooth::EndRule::none));
static_assert(MESHSMOOTH_JOB_STATE_RECEIVING ==
              static_cast<int>(meshsmooth::client::JobState::receiving));

}  // namespace

int meshsmooth_report_summary(const meshsmooth_report* report, meshsmooth_summary* summary,
                              meshsmooth_error** error) {
  return guarded(error, [&] {
    need(report, "report");
    need(summary, "summary");
    write_structure(summarize(report->report), summary->size, summary, "summary");
  });
}

int meshsmooth_report_json(const meshsmooth_report* report, const char** json,
                           meshsmooth_error** error) {
  return guarded(error, [&] {
    need(json, "json");
    *json = nullptr;
    need(report, "report");
    std::call_once(report->json_written, [&] { report->json = report->report.to_json(); });
    *json = report->json.c_str();
  });
}

const char* meshsmooth_report_job_name(const meshsmooth_report* report) {
  return report != nullptr ? report->report.job_name.c_str() : "";
}

const char* meshsmooth_report_server_version(const meshsmooth_report* report) {
  return report != nullptr ? report->report.server_version.c_str() : "";
}

void meshsmooth_report_free(meshsmooth_report* report) { delete report; }
