#include "requirement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
#include <numeric>
#include <string_view>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

using Subject = Requirement::Subject;
using Comparison = Requirement::Comparison;

constexpr std::array<std::pair<std::string_view, Comparison>, 6> kComparisons = {
    {{">=", Comparison::at_least},
     {"<=", Comparison::at_most},
     {">", Comparison::above},
     {"<", Comparison::below},
     {"==", Comparison::equal},
     {"!=", Comparison::unequal}}};
constexpr std::array<std::pair<std::string_view, Subject>, 3> kStatistics = {
    {{"min", Subject::min}, {"max", Subject::max}, {"mean", Subject::mean}}};
constexpr std::array<std::pair<std::string_view, Subject>, 3> kCounts = {
    {{"inverted", Subject::inverted},
     {"degenerate", Subject::degenerate},
     {"elements", Subject::elements}}};
constexpr std::string_view kPercentile = "percentile_";
constexpr std::size_t kWorstCount = 10;

template <class Table>
auto find_in(const Table& table, std::string_view name) {
  const auto found = std::ranges::find(table, name, [](const auto& row) { return row.first; });
  return found == table.end() ? std::nullopt : std::optional(found->second);
}

template <class Names, class NameOf>
std::string listed(const Names& names, NameOf name_of) {
  std::string text;
  for (const auto& name : names) {
    if (!text.empty()) text += ", ";
    text += name_of(name);
  }
  return text;
}

bool is_count(Subject subject) {
  return subject == Subject::inverted || subject == Subject::degenerate ||
         subject == Subject::elements;
}

class Parser {
 public:
  explicit Parser(const std::string& text) : text_(text) {}

  Requirement parse() {
    Requirement result;
    std::string_view word = next_word();
    if (const auto count = find_in(kCounts, word)) {
      result.subject = *count;
    } else {
      if (parse_statistic(word, result)) word = next_word();
      result.metric = find_element_metric(word);
      if (!result.metric) fail_unknown(word, result.subject == Subject::each);
    }
    const std::string_view subject = trimmed(text_.substr(0, at_));
    const std::string_view operation = next([](char c) { return is_one_of(c, "<>=!"); });
    const auto comparison = find_in(kComparisons, operation);
    if (!comparison) {
      fail("expected one of " + listed(kComparisons, [](const auto& row) { return row.first; }));
    }
    result.comparison = *comparison;
    const std::string_view number =
        next([](char c) { return std::isspace(static_cast<unsigned char>(c)) == 0; });
    const std::string_view digits = number.starts_with('+') ? number.substr(1) : number;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), result.bound);
    if (error != std::errc() || end != digits.data() + digits.size() ||
        !std::isfinite(result.bound)) {
      fail("expected a number");
    }
    if (!next([](char) { return true; }).empty()) fail("expected nothing after the number");
    result.text = fmt::format("{} {} {}", subject, operation, number);
    return result;
  }

 private:
  static bool is_one_of(char c, std::string_view set) {
    return set.find(c) != std::string_view::npos;
  }
  static std::string_view trimmed(std::string_view text) {
    const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
    return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
  }

  /// The characters from the next that is no blank on, as long as `belongs`.
  template <class Belongs>
  std::string_view next(const Belongs& belongs) {
    while (at_ < text_.size() && is_one_of(text_[at_], " \t")) ++at_;
    place_ = at_;
    while (at_ < text_.size() && belongs(text_[at_])) ++at_;
    return text_.substr(place_, at_ - place_);
  }
  std::string_view next_word() {
    return next(
        [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; });
  }

  bool parse_statistic(std::string_view word, Requirement& result) {
    if (const auto statistic = find_in(kStatistics, word)) {
      result.subject = *statistic;
      return true;
    }
    if (!word.starts_with(kPercentile)) return false;
    const std::string_view digits = word.substr(kPercentile.size());
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), result.percentile);
    if (error != std::errc() || end != digits.data() + digits.size() || result.percentile < 1 ||
        result.percentile > 99) {
      fail("percentiles are percentile_1 to percentile_99");
    }
    result.subject = Subject::percentile;
    return true;
  }

  [[noreturn]] void fail_unknown(std::string_view word, bool at_start) {
    const std::string metrics = listed(element_metrics(), element_metric_name);
    const auto name = [](const auto& row) { return row.first; };
    fail((word.empty() ? "expected a metric" : fmt::format("no metric is called \"{}\"", word)) +
         "; metrics are " + metrics +
         (at_start ? "; counts are " + listed(kCounts, name) + "; statistics are " +
                         listed(kStatistics, name) + ", percentile_1 to percentile_99"
                   : ""));
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        fmt::format("--require \"{}\": column {}{}: {}", text_, place_ + 1,
                    place_ < text_.size() ? fmt::format(" (\"{}\")", text_.substr(place_)) : "",
                    what),
        {{"field", "--require"}});
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t place_ = 0;  // of the last token
};

/// How far a value is on the wrong side of the bound.
double excess(const Requirement& requirement, double value) {
  switch (requirement.comparison) {
    case Comparison::at_least:
    case Comparison::above:
      return requirement.bound - value;
    case Comparison::at_most:
    case Comparison::below:
      return value - requirement.bound;
    case Comparison::equal:
      return std::abs(value - requirement.bound);
    case Comparison::unequal:
      break;
  }
  return 0;
}

using Elements = std::vector<RequirementResult::Element>;

/// The worst by `is_worse`, then by id.
template <class IsWorse>
Elements worst_of(Elements elements, const IsWorse& is_worse) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(elements.size(), kWorstCount));
  std::partial_sort(elements.begin(), elements.begin() + count, elements.end(),
                    [&](const auto& a, const auto& b) {
                      if (is_worse(a.value, b.value)) return true;
                      return !is_worse(b.value, a.value) && a.element < b.element;
                    });
  elements.resize(static_cast<std::size_t>(count));
  return elements;
}

RequirementResult evaluate_count(const Requirement& requirement, const ElementTable& table,
                                 const std::vector<double>& mean_ratios) {
  RequirementResult result;
  result.element_count = static_cast<std::int64_t>(table.states.size());
  Elements counted;
  if (requirement.subject == Subject::elements) {
    result.value = static_cast<double>(table.states.size());
  } else {
    const ElementState state = requirement.subject == Subject::inverted ? ElementState::inverted
                                                                        : ElementState::degenerate;
    for (std::size_t e = 0; e < table.states.size(); ++e) {
      if (table.states[e] == state) {
        counted.push_back({static_cast<std::int64_t>(e), mean_ratios[e]});
      }
    }
    result.value = static_cast<double>(counted.size());
  }
  result.met = requirement.accepts(result.value);
  result.breaking_count = static_cast<std::int64_t>(counted.size());
  result.worst = worst_of(std::move(counted), std::less<>());
  return result;
}

/// `values` are those of the elements that have the metric, in any order.
double statistic_of(const Requirement& requirement, std::vector<double> values) {
  switch (requirement.subject) {
    case Subject::mean:
      return std::accumulate(values.begin(), values.end(), 0.0) /
             static_cast<double>(values.size());
    case Subject::percentile: {
      const std::size_t below =
          values.size() * static_cast<std::size_t>(requirement.percentile) / 100;
      const auto nth = values.begin() + static_cast<std::ptrdiff_t>(below);
      std::nth_element(values.begin(), nth, values.end());
      return *nth;
    }
    case Subject::max:
      return *std::ranges::max_element(values);
    case Subject::min:
      return *std::ranges::min_element(values);
    default:  // each: the worst
      return *std::ranges::max_element(values, {},
                                       [&](double v) { return excess(requirement, v); });
  }
}

const std::vector<double>& column_of(const ElementTable& table, ElementMetric metric) {
  const auto found = std::ranges::find(table.metrics, metric);
  return table.columns.at(static_cast<std::size_t>(found - table.metrics.begin()));
}

}  // namespace

bool Requirement::accepts(double value) const {
  switch (comparison) {
    case Comparison::at_least:
      return value >= bound;
    case Comparison::at_most:
      return value <= bound;
    case Comparison::above:
      return value > bound;
    case Comparison::below:
      return value < bound;
    case Comparison::equal:
      return value == bound;
    case Comparison::unequal:
      return value != bound;
  }
  return false;
}

Requirement parse_requirement(const std::string& text) { return Parser(text).parse(); }

ElementMetric metric_of(const Requirement& requirement) {
  return requirement.metric.value_or(QualityMetric::mean_ratio);
}

RequirementResult evaluate(const Requirement& requirement, const ElementTable& table) {
  const std::vector<double>& column = column_of(table, metric_of(requirement));
  if (is_count(requirement.subject)) return evaluate_count(requirement, table, column);
  std::vector<double> values;
  Elements breaking;
  for (std::size_t e = 0; e < column.size(); ++e) {
    if (std::isnan(column[e])) continue;
    values.push_back(column[e]);
    if (!requirement.accepts(column[e])) {
      breaking.push_back({static_cast<std::int64_t>(e), column[e]});
    }
  }
  if (values.empty()) {
    throw InvalidOption("METRIC_UNDEFINED",
                        fmt::format("--require \"{}\": no element of the mesh has the metric {}",
                                    requirement.text, element_metric_name(*requirement.metric)),
                        {{"field", "--require"}});
  }
  RequirementResult result;
  result.element_count = static_cast<std::int64_t>(values.size());
  result.value = statistic_of(requirement, std::move(values));
  result.breaking_count = static_cast<std::int64_t>(breaking.size());
  result.met =
      requirement.subject == Subject::each ? breaking.empty() : requirement.accepts(result.value);
  result.worst = worst_of(std::move(breaking), [&](double a, double b) {
    return excess(requirement, a) > excess(requirement, b);
  });
  return result;
}

}  // namespace meshsmooth::cli
