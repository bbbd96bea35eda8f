#include "boundary_report.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "readable.hpp"

namespace meshsmooth::cli {

std::string describe_volume(const QualityStats& stats) {
  if (stats.enclosed_volume == 0) return {};
  return fmt::format(
      "volume: the elements fill {:.6g}, the boundary encloses {:.6g} ({:.1e} more)\n",
      stats.sum_absolute_volume, stats.enclosed_volume,
      stats.sum_absolute_volume - stats.enclosed_volume);
}

std::string describe_deviation(const SmoothSummary& summary) {
  const BoundaryDeviation& deviation = summary.deviation;
  if (deviation.tolerance == 0) return {};
  std::string text = fmt::format(
      "curved parts: nodes lie within {:.1e} of the facets of the input (tolerance {:.1e}); "
      "the new ones cut off up to {:.3g}",
      deviation.result_to_input, deviation.tolerance, deviation.input_to_result);
  const double before = summary.quality_before.enclosed_volume;
  if (before != 0) {
    text += fmt::format(" and changes the volume by {:+.2g} %",
                        100 * (summary.quality_after.enclosed_volume - before) / before);
  }
  return text + "\n";
}

std::string describe_fit(const std::optional<FitStats>& fit) {
  if (!fit) return {};
  const auto distance = [](const char* what, const SurfaceDistance& d) {
    return fmt::format("{}: largest {:.3g}, mean {:.3g}", what, d.largest, d.mean);
  };
  std::string text = fmt::format(
      "{} of {} lie on the surface ({}, {}, {})\n", with_commas(fit->reached_count),
      counted(fit->node_count, "boundary node"),
      fit->surface.patches == 1 ? "1 patch" : with_commas(fit->surface.patches) + " patches",
      counted(fit->surface.curves, "curve"), counted(fit->surface.corners, "corner"));
  text += distance("  distance from the surface", fit->result_to_surface) +
          fmt::format(" (before: {:.3g}, {:.3g})\n", fit->input_to_surface.largest,
                      fit->input_to_surface.mean) +
          distance("  distance of the surface from the boundary", fit->surface_to_result) + "\n";
  const auto name = [&](std::int64_t count, const char* noun, const char* what) {
    if (count > 0) text += "  " + counted(count, noun) + what + "\n";
  };
  name(fit->held_count, "node", " held off it: elements would not stay valid");
  name(fit->fixed_count, "boundary node", " fixed: by the caller, between regions or in a pair");
  name(fit->unmatched_corner_count, "corner", " of the surface without a node");
  name(fit->unmatched_curve_count, "curve", " of the surface without a path of edges");
  name(fit->surface.open_edges, "edge", " of the surface open");
  name(fit->surface.non_manifold_edges, "edge", " of the surface of more than two triangles");
  name(fit->surface.degenerate_triangles, "triangle", " of the surface without an area");
  return text;
}

}  // namespace meshsmooth::cli
