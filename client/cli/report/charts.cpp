#include "report/charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

// Of the drawing area; labels stand outside.
constexpr double kWidth = 320, kHeight = 110, kLeft = 4, kTop = 6;

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>)", x, y, anchor,
                     text);
}

std::string open_svg(double width, const std::string& label) {
  return fmt::format(R"(<svg viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}">)"
                     R"(<line class="axis" x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}"/>)",
                     width, kTop + kHeight + 20, label, kLeft, kTop + kHeight, kLeft + kWidth,
                     kTop + kHeight);
}

/// The height of a bar; any element at all shows.
double bar_height(std::int64_t count, std::int64_t most) {
  if (count == 0) return 0;
  return std::max(1.5, kHeight * static_cast<double>(count) / static_cast<double>(most));
}

std::string bars(const MetricStats& metric, std::int64_t most, const char* state) {
  const double step = kWidth / static_cast<double>(metric.histogram.size());
  const double bin = (metric.histogram_upper - metric.histogram_lower) /
                     static_cast<double>(metric.histogram.size());
  std::string svg;
  for (std::size_t n = 0; n < metric.histogram.size(); ++n) {
    const std::int64_t count = metric.histogram[n];
    if (count == 0) continue;
    const auto index = static_cast<double>(n);
    const double height = bar_height(count, most);
    svg += fmt::format(
        R"(<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"><title>{:.4g} to {:.4g}: {} {}</title></rect>)",
        state, kLeft + index * step + 0.5, kTop + kHeight - height, step - 1, height,
        metric.histogram_lower + index * bin, metric.histogram_lower + (index + 1) * bin,
        counted(count, "element"), state);
  }
  return svg;
}

/// A line through the values of the sweeps. Those that are not finite, or with `logarithmic` not
/// positive, leave a gap.
std::string line_svg(std::span<const double> values, bool logarithmic, const std::string& label) {
  const auto drawn = [&](double v) { return std::isfinite(v) && (!logarithmic || v > 0); };
  const auto scaled = [&](double v) { return logarithmic ? std::log10(v) : v; };
  double low = INFINITY, high = -INFINITY;
  for (const double v : values) {
    if (!drawn(v)) continue;
    low = std::min(low, scaled(v));
    high = std::max(high, scaled(v));
  }
  if (!(low <= high)) return {};
  const double span = high > low ? high - low : 1;
  const double step = values.size() > 1 ? kWidth / static_cast<double>(values.size() - 1) : 0;
  std::string path, dots;
  bool pen_down = false;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!drawn(values[n])) {
      pen_down = false;
      continue;
    }
    const double x = kLeft + static_cast<double>(n) * step;
    const double y = kTop + kHeight * (1 - 0.95 * (scaled(values[n]) - low) / span);
    path += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", x, y);
    if (values.size() <= 200) {
      dots += fmt::format(
          R"(<circle class="dot" cx="{:.1f}" cy="{:.1f}" r="2.5"><title>sweep {}: {:.4g}</title></circle>)",
          x, y, n + 1, values[n]);
    }
    pen_down = true;
  }
  const auto value = [&](double v) {
    return fmt::format("{:.3g}", logarithmic ? std::pow(10, v) : v);
  };
  return open_svg(kWidth + 64, label) + fmt::format(R"(<path class="line" d="{}"/>)", path) + dots +
         text_at(kLeft + kWidth + 6, kTop + kHeight * 0.05 + 4, "start", value(high)) +
         text_at(kLeft + kWidth + 6, kTop + kHeight, "start", high > low ? value(low) : "") +
         text_at(kLeft, kTop + kHeight + 15, "start", "sweep 1") +
         text_at(kLeft + kWidth, kTop + kHeight + 15, "end", std::to_string(values.size())) +
         "</svg>";
}

std::string figure(const std::string& svg, const std::string& caption) {
  if (svg.empty()) return {};
  return "<figure>" + svg + "<figcaption>" + caption + "</figcaption></figure>";
}

}  // namespace

std::string histogram_svg(const MetricStats* before, const MetricStats& metric) {
  std::int64_t most = 1;
  for (const MetricStats* m : {before, &metric}) {
    if (m != nullptr && !m->histogram.empty())
      most = std::max(most, std::ranges::max(m->histogram));
  }
  std::string svg = open_svg(kWidth + 2 * kLeft, "Histogram");
  if (before != nullptr) svg += bars(*before, most, "before");
  svg += bars(metric, most, before != nullptr ? "after" : "only");
  const double middle = (metric.histogram_lower + metric.histogram_upper) / 2;
  const double y = kTop + kHeight + 15;
  return svg + text_at(kLeft, y, "start", fmt::format("{:g}", metric.histogram_lower)) +
         text_at(kLeft + kWidth / 2, y, "middle", fmt::format("{:g}", middle)) +
         text_at(kLeft + kWidth, y, "end", fmt::format("{:g}", metric.histogram_upper)) + "</svg>";
}

std::string history_figures(const Convergence& convergence) {
  return figure(line_svg(convergence.max_displacements, true, "Largest move of each sweep"),
                "Largest move of each sweep, in the mesh's unit (logarithmic)") +
         figure(line_svg(convergence.worst_mean_ratios, false, "Worst mean ratio after each sweep"),
                "Worst mean ratio of the corners that can change, after each sweep") +
         figure(line_svg(convergence.energies, true, "Energy after each sweep"),
                "Energy after each sweep (logarithmic; infinite, and not drawn, while the mesh is "
                "tangled)");
}

}  // namespace meshsmooth::cli
