#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "mesh/accumulator.hpp"
#include "meshsmooth/summary.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// A least value is lower, and an element below one, only by more than this: moves of the size of
/// rounding count for nothing.
inline constexpr double kQualityRounding = 1e-9;

/// Least values of both metrics.
struct QualityFloor {
  double mean_ratio = std::numeric_limits<double>::infinity();
  double scaled_jacobian = std::numeric_limits<double>::infinity();

  /// Whether a measure is below, or is not a number.
  [[nodiscard]] MESHSMOOTH_HD bool is_above(const ElementMeasure& measure) const {
    return !(measure.mean_ratio >= mean_ratio && measure.scaled_jacobian >= scaled_jacobian);
  }
  [[nodiscard]] QualityFloor lowered() const {
    return {mean_ratio - kQualityRounding, scaled_jacobian - kQualityRounding};
  }
  /// The floor of one metric alone.
  [[nodiscard]] QualityFloor of(QualityMetric metric) const {
    constexpr double kNone = -std::numeric_limits<double>::infinity();
    return metric == QualityMetric::mean_ratio ? QualityFloor{mean_ratio, kNone}
                                               : QualityFloor{kNone, scaled_jacobian};
  }

  /// The lower of both.
  friend MESHSMOOTH_HD QualityFloor operator+(const QualityFloor& a, const QualityFloor& b) {
    return {a.mean_ratio < b.mean_ratio ? a.mean_ratio : b.mean_ratio,
            a.scaled_jacobian < b.scaled_jacobian ? a.scaled_jacobian : b.scaled_jacobian};
  }
};

/// What the elements have before and after, to be combined.
struct QualityChange {
  QualityFloor floor;  // before, of the elements that may move
  double before = 0;   // sums of the metric in force
  double after = 0;
  std::int64_t inverted_before = 0;
  std::int64_t inverted_after = 0;

  friend MESHSMOOTH_HD QualityChange operator+(const QualityChange& a, const QualityChange& b) {
    return {a.floor + b.floor, a.before + b.before, a.after + b.after,
            a.inverted_before + b.inverted_before, a.inverted_after + b.inverted_after};
  }
};

[[nodiscard]] MESHSMOOTH_HD inline double measure_in_force(const ElementMeasure& measure,
                                                           QualityMetric metric) {
  return metric == QualityMetric::mean_ratio ? measure.mean_ratio : measure.scaled_jacobian;
}

/// One element's part of a `QualityChange`.
[[nodiscard]] MESHSMOOTH_HD inline QualityChange change_of(const ElementMeasure& before,
                                                           const ElementMeasure& after,
                                                           bool may_move, QualityMetric metric) {
  return {may_move ? QualityFloor{before.mean_ratio, before.scaled_jacobian} : QualityFloor{},
          measure_in_force(before, metric), measure_in_force(after, metric),
          before.inverted ? 1 : 0, after.inverted ? 1 : 0};
}

/// Whether an element must go back: it is below the floor, or no longer certainly valid.
template <class Before>
[[nodiscard]] MESHSMOOTH_HD bool is_worse(const QualityFloor& floor, const ElementMeasure& now,
                                          const Before& before) {
  const auto certain = [](const ElementMeasure& m) { return !m.inverted && !m.degenerate; };
  return floor.is_above(now) || (!certain(now) && certain(before()));
}

/// Of means, or of sums over the same elements.
[[nodiscard]] inline bool is_mean_lower(double before, double after) {
  return after < before - kMostMeanLoss * std::abs(before);
}

/// The metric that the caller named, or that of the mesh's elements.
[[nodiscard]] inline QualityMetric metric_in_force(const TopologyView& topology,
                                                   const JobPlan& plan) {
  if (plan.options.metric) return *plan.options.metric;
  const bool simplices = std::ranges::all_of(topology.blocks, [](const ElementBlockView& block) {
    return block.nodes.empty() || is_simplex(element_shape(linear_type(block.type)));
  });
  return simplices ? QualityMetric::mean_ratio : QualityMetric::scaled_jacobian;
}

/// Keeps the least values: first of the metric in force, then, unless the caller named one, of
/// both.
///
/// `restore(floor)` moves nodes of elements below a floor back, `restored()` tells how many have
/// gone back since it was last called.
template <class Restore, class Restored>
void keep_least(const QualityFloor& least, const JobPlan& plan, KeptQuality& kept,
                const Restore& restore, const Restored& restored) {
  const bool ratio = kept.metric == QualityMetric::mean_ratio;
  restore(least.lowered().of(kept.metric));
  (ratio ? kept.for_mean_ratio : kept.for_scaled_jacobian) = restored();
  if (plan.options.metric) return;
  restore(least.lowered());
  (ratio ? kept.for_scaled_jacobian : kept.for_mean_ratio) = restored();
}

/// Whether a result may be worse than its input, from full evaluations. Where elements were
/// untangled, nothing is taken back. Behind the least value of a locked element, those of the
/// others may have fallen unseen.
[[nodiscard]] inline bool may_be_worse(const QualityStats& before, const QualityStats& after,
                                       const LockedStats& locked, const JobPlan& plan,
                                       QualityMetric in_force) {
  if (after.inverted_count < before.inverted_count) return false;
  for (std::size_t m = 0; m < before.metrics.size(); ++m) {
    const MetricStats &first = before.metrics[m], &last = after.metrics[m];
    const bool falls = first.metric == in_force && is_mean_lower(first.mean, last.mean);
    if (falls && plan.keeps_mean) return true;
    const bool kept = plan.options.metric ? first.metric == in_force
                                          : first.metric == QualityMetric::mean_ratio ||
                                                first.metric == QualityMetric::scaled_jacobian;
    if (!kept) continue;
    if (last.min < first.min - kQualityRounding) return true;
    if (locked.element_count > 0 && last.min <= first.min + kQualityRounding) return true;
  }
  return false;
}

}  // namespace meshsmooth::detail
