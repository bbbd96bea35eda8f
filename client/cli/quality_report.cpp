#include "quality_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

bool is_angle(QualityMetric metric) {
  return metric != QualityMetric::mean_ratio && metric != QualityMetric::scaled_jacobian &&
         metric != QualityMetric::radius_ratio;
}

std::string label(QualityMetric metric) {
  std::string name(metric_name(metric));
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::string metric_line(const MetricStats& m) {
  const int digits = is_angle(m.metric) ? 2 : 4;
  return fmt::format("{:<19} {:>9.{}f} {:>9.{}f} {:>9.{}f} {:>9.{}f}  {:>4g} |{}| {:g}\n",
                     label(m.metric), m.min, digits, m.percentile_1, digits, m.mean, digits, m.max,
                     digits, m.histogram_lower, draw_histogram(m.histogram), m.histogram_upper);
}

std::string worst_lines(const QualityStats& stats,
                        const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  if (stats.worst.empty()) return {};
  std::string text = fmt::format("\nworst {:>12} {:<12} {:>10} {:>16}\n", "element", "type",
                                 "mean ratio", "scaled jacobian");
  for (const ElementQuality& element : stats.worst) {
    text += fmt::format("{:>18} {:<12} {:>10.4f} {:>16.4f}\n", file_element_id(element.element),
                        element_name(element.type), element.mean_ratio, element.scaled_jacobian);
  }
  return text;
}

}  // namespace

std::string draw_histogram(const std::vector<std::int64_t>& bins) {
  static constexpr std::array kHeights = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const std::int64_t highest = bins.empty() ? 0 : *std::ranges::max_element(bins);
  std::string text;
  for (const std::int64_t count : bins) {
    const auto height =
        count == 0 ? 0 : std::max<std::int64_t>(1, (count * 8 + highest / 2) / highest);
    text += kHeights[static_cast<std::size_t>(height)];
  }
  return text;
}

std::string describe_quality(const QualityStats& stats,
                             const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  std::string text =
      fmt::format("{:<19} {:>9} {:>9} {:>9} {:>9}\n", counted(stats.element_count, "element"),
                  "min", "1 %", "mean", "max");
  for (const MetricStats& metric : stats.metrics) {
    if (metric.element_count > 0) text += metric_line(metric);
  }
  text += fmt::format("\ninverted {} ({}), degenerate {} ({})\n", with_commas(stats.inverted_count),
                      percentage(stats.inverted_count, stats.element_count),
                      with_commas(stats.degenerate_count),
                      percentage(stats.degenerate_count, stats.element_count));
  return text + describe_reading(stats, file_element_id) + worst_lines(stats, file_element_id);
}

std::string describe_reading(const QualityStats& stats,
                             const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  std::string text;
  if (stats.mirrored_count > 0) {
    std::string ids;
    for (const std::int64_t element : stats.mirrored) {
      ids += (ids.empty() ? "" : ", ") + std::to_string(file_element_id(element));
    }
    const auto listed = static_cast<std::int64_t>(stats.mirrored.size());
    text += fmt::format(
        "{} {} numbered the other way round and read as if {} were not: {}{}\n",
        counted(stats.mirrored_count, "element"), stats.mirrored_count == 1 ? "is" : "are",
        stats.mirrored_count == 1 ? "it" : "they", ids, stats.mirrored_count > listed ? " …" : "");
  }
  if (stats.collapsed_count > 0) {
    text += counted(stats.collapsed_count, "element") +
            " with repeated nodes: read as the type that the nodes form\n";
  }
  if (stats.interface_count > 0) {
    text += counted(stats.interface_count, "interface element") +
            " without thickness: not evaluated, their nodes stay\n";
  }
  return text;
}

std::string describe_kept_quality(const SmoothSummary& summary) {
  std::string text;
  const KeptQuality kept = summary.kept_quality.value_or(KeptQuality{});
  if (const std::int64_t count = kept.restored_node_count(); count > 0) {
    const std::pair<std::string, std::int64_t> reasons[] = {
        {"the least mean ratio", kept.for_mean_ratio},
        {"the least scaled jacobian", kept.for_scaled_jacobian},
        {"the mean " + label(kept.metric), kept.for_mean}};
    text = fmt::format("{} went back, so that these did not fall:", counted(count, "node"));
    const char* separator = " ";
    for (const auto& [what, nodes] : reasons) {
      if (nodes == 0) continue;
      text += fmt::format("{}{} ({})", std::exchange(separator, ", "), what, with_commas(nodes));
    }
    text += '\n';
  }
  const char* separator = "worse than before: ";
  for (const LowerMeasure& lower : find_lower(summary)) {
    text +=
        fmt::format("{}{} {} {:.4f}, was {:.4f}", std::exchange(separator, "; "),
                    lower.mean ? "mean" : "least", label(lower.metric), lower.after, lower.before);
  }
  const bool worse = *separator == ';';
  return text + (worse ? "\n" : "");
}

std::string describe_notes(const formats::MeshFile& file) {
  std::string text;
  for (const std::string& note : file.notes()) text += "note: " + note + '\n';
  return text;
}

std::string describe_held_cells(const formats::MeshFile& file) {
  std::int64_t count = 0;
  std::string types;
  for (const formats::HeldCells& held : file.held_cells()) {
    count += held.count;
    types += fmt::format("{}{} {}", types.empty() ? "" : ", ", held.name, with_commas(held.count));
  }
  if (count == 0) return "";
  return fmt::format("{} cannot be smoothed and {} nodes fixed: {}\n", counted(count, "cell"),
                     count == 1 ? "keeps its" : "keep their", types);
}

std::string describe_inner_cells(const formats::InnerCells& inner) {
  if (inner.nodes.empty()) return "";
  std::string names;
  for (const std::string& name : inner.names) names += (names.empty() ? ": " : ", ") + name;
  return counted(static_cast<std::int64_t>(inner.nodes.size()), "node") +
         " of surfaces, lines and points inside the mesh stay" + names + '\n';
}

}  // namespace meshsmooth::cli
