#pragma once

#include <cmath>
#include <span>

#include "mesh/accumulator.hpp"

namespace meshsmooth::detail {

/// Where the values of each metric go, for host and device.
class MetricColumns {
 public:
  /// @param values  [metrics.size()][element_count], in the memory of whoever stores
  MetricColumns(std::span<const QualityMetric> metrics, float* values, std::size_t element_count) {
    for (const QualityMetric metric : metrics) {
      columns_[static_cast<std::size_t>(metric)] = values;
      values += element_count;
    }
  }

  /// Stores the metrics of one element; NaN for those that its type does not have.
  MESHSMOOTH_HD void store(const ElementShape& shape, const ElementMeasure& measure,
                           std::size_t element) const {
    for (float* const column : columns_) {
      if (column != nullptr) column[element] = NAN;
    }
    for_each_metric(shape, measure, [&](int, QualityMetric metric, double value) {
      float* const column = columns_[static_cast<std::size_t>(metric)];
      if (column != nullptr) column[element] = static_cast<float>(finite_measure(value));
    });
  }

 private:
  float* columns_[kMetricCount] = {};  // null: the metric is not asked for
};

}  // namespace meshsmooth::detail
