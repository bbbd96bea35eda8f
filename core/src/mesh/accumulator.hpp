#pragma once

// Statistics over the measures of all elements.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh/measure.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

inline constexpr std::size_t kMetricCount = kQualityMetrics.size();
inline constexpr std::size_t kBinCount = 2048;
inline constexpr std::size_t kHistogramSize = 32;
inline constexpr std::size_t kWorstCount = 10;
/// What the histograms of a metric cover.
struct MetricRange {
  double lower, upper;
};
MESHSMOOTH_HD constexpr MetricRange metric_range(std::size_t metric) {
  return metric < 3 ? MetricRange{-1, 1} : MetricRange{0, 180};
}

/// The fine bin of a value; the outer ones include values outside.
MESHSMOOTH_HD inline std::size_t metric_bin(std::size_t metric, double value) {
  const MetricRange range = metric_range(metric);
  const double bin = (value - range.lower) * (kBinCount / (range.upper - range.lower));
  return bin > 0 ? bin < kBinCount - 1.0 ? static_cast<std::size_t>(bin) : kBinCount - 1 : 0;
}

MESHSMOOTH_HD inline double degrees(double cosine) {
  return std::acos(cosine) * (180 / 3.14159265358979323846);
}

/// The measure of an element whose coordinates overflow is 0.
MESHSMOOTH_HD inline double finite_measure(double value) {
  return std::isfinite(value) ? value : 0;
}

/// The table of the metrics per type: calls `add(index, metric, value)` for each.
template <class Add>
MESHSMOOTH_HD void for_each_metric(const ElementShape& shape, const ElementMeasure& m,
                                   const Add& add) {
  add(0, QualityMetric::mean_ratio, m.mean_ratio);
  add(1, QualityMetric::scaled_jacobian, m.scaled_jacobian);
  if (shape.dimension == 3 && shape.node_count == 4) {
    add(2, QualityMetric::radius_ratio, m.radius_ratio);
    add(3, QualityMetric::min_dihedral_angle, degrees(m.min_angle_cos));
    add(4, QualityMetric::max_dihedral_angle, degrees(m.max_angle_cos));
  } else if (shape.dimension == 2 && shape.node_count == 3) {
    add(2, QualityMetric::min_angle, degrees(m.min_angle_cos));
    add(3, QualityMetric::max_angle, degrees(m.max_angle_cos));
  }
}

/// The metrics of a type, the first `count` of them.
inline constexpr int kMostMetrics = 5;
struct MetricsOfType {
  int count = 0;
  int metrics[kMostMetrics] = {};
};
MESHSMOOTH_HD inline MetricsOfType metrics_of(const ElementShape& shape) {
  MetricsOfType result;
  for_each_metric(shape, ElementMeasure{}, [&](int index, QualityMetric metric, double) {
    result.metrics[index] = static_cast<int>(metric);
    result.count = index + 1;
  });
  return result;
}

inline bool worse(const ElementQuality& a, const ElementQuality& b) {
  return a.mean_ratio != b.mean_ratio ? a.mean_ratio < b.mean_ratio : a.element < b.element;
}

struct ChunkSums {
  std::array<double, kMetricCount> values{};
  double volume = 0;           // of |V|
  double enclosed_volume = 0;  // of V, volume elements only
};

/// What a brief evaluation counts, of one thread. Independent of the order of elements.
struct BriefAccumulator {
  std::int64_t inverted = 0, degenerate = 0;
  std::vector<ElementQuality> worst;  // a heap, the least bad on top

  /// An element of which the cube of the mean ratio is above this, whatever its rounding, is not
  /// among the worst.
  [[nodiscard]] double cube_below_which_kept() const {
    if (worst.size() < kWorstCount) return std::numeric_limits<double>::infinity();
    const double bar = worst.front().mean_ratio;
    return bar * bar * bar + 1e-9;
  }

  void add_briefly(const ElementMeasure& measure, ElementType type, std::int64_t element,
                   ChunkSums& sums) {
    inverted += measure.inverted ? 1 : 0;
    degenerate += measure.degenerate ? 1 : 0;
    sums.volume += std::abs(measure.volume);
    if (element_shape(type).dimension == 3) sums.enclosed_volume += measure.volume;
    keep_if_worst({element, type, finite_measure(measure.mean_ratio),
                   finite_measure(measure.scaled_jacobian)});
  }

  void keep_if_worst(const ElementQuality& quality) {
    if (worst.size() == kWorstCount) {
      if (!worse(quality, worst.front())) return;
      std::pop_heap(worst.begin(), worst.end(), worse);
      worst.pop_back();
    }
    worst.push_back(quality);
    std::push_heap(worst.begin(), worst.end(), worse);
  }

  void merge(const BriefAccumulator& other) {
    inverted += other.inverted;
    degenerate += other.degenerate;
    for (const ElementQuality& quality : other.worst) keep_if_worst(quality);
  }
};

/// The same, and the metrics.
struct QualityAccumulator : BriefAccumulator {
  std::array<std::array<std::int64_t, kBinCount>, kMetricCount> bins{};
  std::array<double, kMetricCount> min, max;

  QualityAccumulator() {
    min.fill(std::numeric_limits<double>::infinity());
    max.fill(-std::numeric_limits<double>::infinity());
  }

  void add(QualityMetric metric, double value, ChunkSums& sums) {
    const auto m = static_cast<std::size_t>(metric);
    value = finite_measure(value);
    ++bins[m][metric_bin(m, value)];
    min[m] = std::min(min[m], value);
    max[m] = std::max(max[m], value);
    sums.values[m] += value;
  }

  void add(const ElementMeasure& measure, ElementType type, std::int64_t element, ChunkSums& sums) {
    for_each_metric(element_shape(type), measure,
                    [&](int, QualityMetric metric, double value) { add(metric, value, sums); });
    add_briefly(measure, type, element, sums);
  }

  void merge(const QualityAccumulator& other) {
    for (std::size_t m = 0; m < kMetricCount; ++m) {
      for (std::size_t b = 0; b < kBinCount; ++b) bins[m][b] += other.bins[m][b];
      min[m] = std::min(min[m], other.min[m]);
      max[m] = std::max(max[m], other.max[m]);
    }
    BriefAccumulator::merge(other);
  }
};

inline MetricStats summarize(std::size_t m, const QualityAccumulator& accumulate,
                             std::int64_t count, double sum) {
  const MetricRange scale = metric_range(m);
  MetricStats stats{.metric = static_cast<QualityMetric>(m),
                    .element_count = count,
                    .min = accumulate.min[m],
                    .mean = sum / static_cast<double>(count),
                    .max = accumulate.max[m],
                    .histogram_lower = scale.lower,
                    .histogram_upper = scale.upper,
                    .histogram = std::vector<std::int64_t>(kHistogramSize, 0)};
  for (std::size_t b = 0; b < kBinCount; ++b) {
    stats.histogram[b / (kBinCount / kHistogramSize)] += accumulate.bins[m][b];
  }
  // The highest bin edge with at most 1 % below; never below the least value.
  std::int64_t below = 0;
  std::size_t bin = 0;
  while (100 * (below + accumulate.bins[m][bin]) <= count) below += accumulate.bins[m][bin++];
  stats.percentile_1 =
      std::max(stats.min,
               scale.lower + (scale.upper - scale.lower) * (static_cast<double>(bin) / kBinCount));
  return stats;
}

/// The statistics from all counts and sums, without metrics.
inline QualityStats summarize(const BriefAccumulator& accumulate, const ChunkSums& sums,
                              std::int64_t element_count) {
  QualityStats stats;
  stats.element_count = element_count;
  stats.inverted_count = accumulate.inverted;
  stats.degenerate_count = accumulate.degenerate;
  stats.sum_absolute_volume = sums.volume;
  stats.enclosed_volume = sums.enclosed_volume;
  stats.worst = accumulate.worst;
  std::sort(stats.worst.begin(), stats.worst.end(), worse);
  return stats;
}

/// The same with the metrics.
inline QualityStats summarize(const QualityAccumulator& accumulate, const ChunkSums& sums,
                              std::int64_t element_count) {
  const BriefAccumulator& brief = accumulate;
  QualityStats stats = summarize(brief, sums, element_count);
  for (std::size_t m = 0; m < kMetricCount; ++m) {
    std::int64_t count = 0;
    for (const std::int64_t in_bin : accumulate.bins[m]) count += in_bin;
    if (count > 0) stats.metrics.push_back(summarize(m, accumulate, count, sums.values[m]));
  }
  return stats;
}

}  // namespace meshsmooth::detail
