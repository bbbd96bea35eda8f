#include "meshsmooth/summary.hpp"

#include <algorithm>
#include <cmath>

namespace meshsmooth {

std::vector<LowerMeasure> find_lower(const SmoothSummary& summary) {
  constexpr double kLeast = 1e-6;
  std::vector<LowerMeasure> lower;
  if (summary.motion) return lower;
  for (const MetricStats& before : summary.quality_before.metrics) {
    if (before.metric != QualityMetric::mean_ratio &&
        before.metric != QualityMetric::scaled_jacobian) {
      continue;
    }
    const auto& all = summary.quality_after.metrics;
    const auto after = std::ranges::find(all, before.metric, &MetricStats::metric);
    if (after == all.end()) continue;
    if (after->min < before.min - kLeast) {
      lower.push_back({before.metric, false, before.min, after->min});
    }
    const bool in_force = !summary.kept_quality || summary.kept_quality->metric == before.metric;
    if (in_force && after->mean < before.mean - kMostMeanLoss * std::abs(before.mean)) {
      lower.push_back({before.metric, true, before.mean, after->mean});
    }
  }
  return lower;
}

}  // namespace meshsmooth
