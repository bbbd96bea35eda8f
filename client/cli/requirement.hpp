#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshsmooth/shape_metrics.hpp"

namespace meshsmooth::cli {

/// A condition on the quality of a mesh, as `--require` has it.
///
///   REQUIREMENT  [STATISTIC] METRIC OP NUMBER | COUNT OP NUMBER
///   STATISTIC    min, max, mean, percentile_1 to percentile_99; none: each element by itself
///   METRIC       a name of `element_metrics()`
///   COUNT        inverted, degenerate, elements
///   OP           >= <= > < == !=
struct Requirement {
  enum class Subject { each, min, max, mean, percentile, inverted, degenerate, elements };
  enum class Comparison { at_least, at_most, above, below, equal, unequal };

  std::string text;  // in one spelling: "min scaled_jacobian >= 0.2"
  Subject subject = Subject::each;
  int percentile = 0;
  std::optional<ElementMetric> metric;  // unless a count
  Comparison comparison = Comparison::at_least;
  double bound = 0;

  [[nodiscard]] bool accepts(double value) const;
};

/// Throws `InvalidOption` that shows the place and the known names.
[[nodiscard]] Requirement parse_requirement(const std::string& text);

/// How a mesh meets a requirement.
struct RequirementResult {
  bool met = false;
  double value = 0;                // of the statistic or count; of `each`, the worst
  std::int64_t element_count = 0;  // that have the metric
  /// Elements that break the bound by themselves, or that are counted though they should not be.
  std::int64_t breaking_count = 0;
  struct Element {
    std::int64_t element;
    double value;  // of the metric; of counts, the mean ratio
  };
  std::vector<Element> worst;  // of them, worst first; at most 10
};

/// The column that a table needs for a requirement; counts list their elements by mean ratio.
[[nodiscard]] ElementMetric metric_of(const Requirement& requirement);

/// Throws `InvalidOption` (METRIC_UNDEFINED) where no element has the metric. A percentile_N is
/// the highest value with at most N % of the elements below. O(elements log elements).
[[nodiscard]] RequirementResult evaluate(const Requirement& requirement, const ElementTable& table);

}  // namespace meshsmooth::cli
