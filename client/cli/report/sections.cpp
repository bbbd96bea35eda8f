#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "readable.hpp"
#include "report/charts.hpp"
#include "report/encoding.hpp"

namespace meshsmooth::cli {
namespace {

constexpr std::size_t kTableRows = 20;
constexpr std::pair<ElementMark, const char*> kMarkTexts[] = {
    {kLocked, "locked"}, {kLimited, "limited"}, {kBlocksMotion, "blocks the motion"}};

const MetricStats* find_stats(const QualityStats* stats, QualityMetric metric) {
  if (stats == nullptr) return nullptr;
  const auto found = std::ranges::find(stats->metrics, metric, &MetricStats::metric);
  return found == stats->metrics.end() || found->element_count == 0 ? nullptr : &*found;
}

std::string figure(const std::string& name, const std::string& before, const std::string& after) {
  const std::string was =
      before.empty() ? "" : fmt::format(R"(<span class="was">{} →</span> )", before);
  return fmt::format(R"(<div class="figure"><b>{}{}</b><small>{}</small></div>)", was, after, name);
}

std::string metric_rows(const MetricStats& m, const char* state, int digits) {
  return fmt::format(
      "<tr><td>{}</td><td>{:.{}f}</td><td>{:.{}f}</td><td>{:.{}f}</td><td>{:.{}f}</td></tr>", state,
      m.min, digits, m.percentile_1, digits, m.mean, digits, m.max, digits);
}

std::string condition(const ElementMeasure& measure) {
  return measure.inverted ? "inverted" : measure.degenerate ? "degenerate" : "";
}

}  // namespace

std::string figures_html(const QualityStats* before, const QualityStats& after,
                         std::size_t node_count) {
  const auto of = [&](const QualityStats* stats, double MetricStats::*value) {
    const MetricStats* m = find_stats(stats, QualityMetric::mean_ratio);
    return m == nullptr ? std::string() : fmt::format("{:.4f}", m->*value);
  };
  const auto count = [&](const QualityStats* stats, std::int64_t QualityStats::*value) {
    return stats == nullptr ? std::string() : with_commas(stats->*value);
  };
  std::string html;
  if (!after.metrics.empty()) {
    html +=
        figure("worst mean ratio", of(before, &MetricStats::min), of(&after, &MetricStats::min)) +
        figure("mean of the mean ratios", of(before, &MetricStats::mean),
               of(&after, &MetricStats::mean));
  }
  return html +
         figure("inverted elements", count(before, &QualityStats::inverted_count),
                count(&after, &QualityStats::inverted_count)) +
         figure("elements", "", with_commas(after.element_count)) +
         figure("nodes", "", with_commas(static_cast<std::int64_t>(node_count)));
}

std::string list_html(std::string_view lines) {
  std::string html;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    std::string line(lines.substr(0, end));
    lines.remove_prefix(std::min(end + 1, lines.size()));
    if (line.empty()) continue;
    if (line[0] >= 'a' && line[0] <= 'z') line[0] = static_cast<char>(line[0] - 'a' + 'A');
    html += "<li>" + escape_html(line) + "</li>";
  }
  return html;
}

std::string metrics_html(const QualityStats* before, const QualityStats& after) {
  std::string html;
  if (before != nullptr) {
    html += R"(<p class="note"><span class="swatch before"></span>before)"
            R"( <span class="swatch after"></span>after</p>)";
  }
  html += R"(<div class="metrics">)";
  for (const MetricStats& m : after.metrics) {
    if (m.element_count == 0) continue;
    std::string name(metric_name(m.metric));
    const bool angle = name.ends_with("angle");
    std::ranges::replace(name, '_', ' ');
    const MetricStats* old = find_stats(before, m.metric);
    const int digits = angle ? 2 : 4;
    html += fmt::format(
        "<div><h3>{}{}</h3>{}<table><tr><th></th><th>min</th><th>1 "
        "%</th><th>mean</th><th>max</th></tr>"
        "{}{}</table></div>",
        name, angle ? ", degrees" : "", histogram_svg(old, m),
        old == nullptr ? "" : metric_rows(*old, "before", digits),
        metric_rows(m, old == nullptr ? "all" : "after", digits));
  }
  return html + "</div>";
}

std::string worst_html(const DrawnMesh& mesh, std::span<const ShownElement> elements,
                       const formats::MeshFile& file) {
  const bool two = mesh.before.has_value();
  const auto pair = [&](const char* name) {
    return two ? fmt::format("<th>{} before</th><th>after</th>", name)
               : fmt::format("<th>{}</th>", name);
  };
  std::string html =
      R"(<div class="scroll"><table><tr><th>element</th><th class="text">type</th>)" +
      pair("mean ratio") + pair("scaled Jacobian") +
      R"(<th>centre</th><th class="text">note</th></tr>)";
  for (const ShownElement& shown : elements.first(std::min(kTableRows, elements.size()))) {
    const auto values = [&](double ElementMeasure::*value) {
      return (two ? fmt::format("<td>{:.4f}</td>", shown.before.*value) : "") +
             fmt::format("<td>{:.4f}</td>", shown.measure.*value);
    };
    const auto node_count = element_width(shown.type);
    const Vec3d centre = centre_of(mesh.positions, {shown.nodes, node_count});
    std::string note = condition(shown.measure);
    for (const auto& [mark, text] : kMarkTexts) {
      if (shown.marks & mark) note += (note.empty() ? "" : ", ") + std::string(text);
    }
    const std::int64_t id = file.file_element_id(static_cast<std::int64_t>(shown.element));
    html += fmt::format(
        R"(<tr><td><button type="button" data-element="{}">{}</button></td><td class="text">{}</td>{}{}<td>{:.5g}, {:.5g}, {:.5g}</td><td class="text">{}</td></tr>)",
        id, id, element_name(shown.type), values(&ElementMeasure::mean_ratio),
        values(&ElementMeasure::scaled_jacobian), centre.x, centre.y, centre.z, note);
  }
  return html + "</table></div>";
}

std::string definitions_html(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string html = "<dl>";
  for (const auto& [name, value] : rows) {
    if (!value.empty()) html += fmt::format("<dt>{}</dt><dd>{}</dd>", name, escape_html(value));
  }
  return html + "</dl>";
}

}  // namespace meshsmooth::cli
