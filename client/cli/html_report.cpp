#include "html_report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <string_view>
#include <utility>

#include "boundary_report.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "quality_report.hpp"
#include "readable.hpp"
#include "report/charts.hpp"
#include "report/encoding.hpp"
#include "report/limited_elements.hpp"
#include "report/page.hpp"
#include "report/scene.hpp"
#include "report/sections.hpp"
#include "report/shown_elements.hpp"
#include "summary_report.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::cli {
namespace {

/// Replaces each {{name}}, once: substituted text is not expanded again.
std::string fill(std::string_view text, const std::map<std::string_view, std::string>& values) {
  std::string page;
  for (;;) {
    const std::size_t open = text.find("{{");
    page += text.substr(0, open);
    if (open == std::string_view::npos) return page;
    const std::size_t close = text.find("}}", open);
    page += values.at(text.substr(open + 2, close - open - 2));
    text.remove_prefix(close + 2);
  }
}

struct Outcome {
  const char* css_class;
  std::string text;
};

Outcome outcome_of(const QualityStats* before, const QualityStats& stats) {
  const auto are = [](std::int64_t count) { return count == 1 ? "is" : "are"; };
  if (stats.inverted_count > 0) {
    return {"bad", fmt::format("Not valid: {} of {} {} inverted", with_commas(stats.inverted_count),
                               counted(stats.element_count, "element"), are(stats.inverted_count))};
  }
  if (stats.degenerate_count > 0) {
    return {"warn",
            fmt::format("No element is inverted, but {} {} degenerate (no volume)",
                        counted(stats.degenerate_count, "element"), are(stats.degenerate_count))};
  }
  if (before != nullptr && before->inverted_count > 0) {
    return {"good", fmt::format("Valid: no element is inverted any more, {} {} before",
                                with_commas(before->inverted_count),
                                before->inverted_count == 1 ? "was" : "were")};
  }
  return {"good", "Valid: no element is inverted or degenerate"};
}

std::string view_note(const Scene& scene, std::size_t element_count, bool two, bool volume) {
  std::string text = fmt::format(
      "{}: {}", volume ? "The boundary, translucent" : "The surface",
      scene.triangle_count < scene.whole_triangle_count
          ? fmt::format("simplified, {} of {} triangles",
                        with_commas(static_cast<std::int64_t>(scene.triangle_count)),
                        with_commas(static_cast<std::int64_t>(scene.whole_triangle_count)))
          : counted(static_cast<std::int64_t>(scene.triangle_count), "triangle"));
  return text + fmt::format(". {}, worst first: {}, coloured by mean ratio (1 is ideal, 0 flat).",
                            volume ? "Solids" : "With outlines",
                            counted(static_cast<std::int64_t>(element_count), "element") +
                                (two ? " of those that are or were worst" : ""));
}

std::string now() { return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))); }

/// What both kinds of reports have.
struct Content {
  const char* kind;
  std::string heading;
  std::string findings;  // sentences by lines
  const QualityStats* before = nullptr;
  const QualityStats& after;
  std::string history = {};
  std::string about = {};
  std::optional<Outcome> outcome = {};  // unless it follows from the quality
};

std::string make_page(const Content& content, const DrawnMesh& mesh,
                      std::span<const ShownElement> elements, const formats::MeshFile& file) {
  const Scene scene = make_scene(mesh, elements,
                                 {[&](std::int64_t id) { return file.file_element_id(id); },
                                  [&](std::int64_t id) { return file.file_node_id(id); }});
  const bool two = mesh.before.has_value();
  const bool volume = element_shape(mesh.topology.blocks.front().type).dimension == 3;
  const Outcome outcome =
      content.outcome ? *content.outcome : outcome_of(content.before, content.after);
  return fill(page::html,
              {{"title", escape_html(std::string("meshsmooth: ") + content.heading)},
               {"css", std::string(page::css)},
               {"kind", content.kind},
               {"heading", escape_html(content.heading)},
               {"result_class", outcome.css_class},
               {"result", outcome.text},
               {"figures", figures_html(content.before, content.after, mesh.topology.node_count)},
               {"findings", list_html(content.findings)},
               {"view_note", view_note(scene, elements.size(), two, volume)},
               {"worst_title", two ? "Worst elements of the result" : "Worst elements"},
               {"worst", worst_html(mesh, elements, file)},
               {"quality", metrics_html(content.before, content.after)},
               {"history", content.history},
               {"about", content.about},
               {"scene", scene.json},
               {"camera_js", std::string(page::camera)},
               {"viewer_js", std::string(page::viewer)},
               {"page_js", std::string(page::script)}});
}

/// The nodes that a job fixes, as far as they are known here: on planes and lines of a sliding
/// boundary it is the server that decides.
std::vector<std::uint8_t> fixed_nodes(const formats::MeshFile& file, const JobInput& given,
                                      BoundaryPolicy boundary) {
  std::vector<std::uint8_t> fixed = file.mesh.fixed;
  fixed.resize(file.mesh.node_count());
  for (const NodePair& pair : given.node_pairs) {
    for (const NodeId node : pair) fixed[static_cast<std::size_t>(node)] = 1;
  }
  for (const NodeId node : given.prescribed.nodes) fixed[static_cast<std::size_t>(node)] = 0;
  if (boundary != BoundaryPolicy::fixed) return fixed;
  const MeshTopology topology(file.mesh);
  for (const NodeId node : find_boundary_nodes(topology.view())) {
    fixed[static_cast<std::size_t>(node)] = 1;
  }
  if (file.mesh.regions.empty()) return fixed;
  // Nodes of several regions are on the facets between them.
  const auto& regions = file.mesh.regions;
  std::vector<std::size_t> first(file.mesh.node_count(), regions.size());  // element of a node
  std::size_t element = 0;
  for (const ElementBlock& block : file.mesh.blocks) {
    const auto width = element_width(block.type);
    for (std::size_t n = 0; n < block.nodes.size(); ++n) {
      const auto node = static_cast<std::size_t>(block.nodes[n]);
      const std::size_t own = element + n / width;
      if (first[node] == regions.size()) first[node] = own;
      if (regions[first[node]] != regions[own]) fixed[node] = 1;
    }
    element += block.nodes.size() / width;
  }
  return fixed;
}

std::string about_job(const KeptInput& input, const std::filesystem::path& output,
                      const client::SmoothReport& report, double total_seconds) {
  const SmoothSummary& summary = report.summary;
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"Input", file_name(input.path)},
      {"Output", file_name(output)},
      {"Request id", report.request_id},
      {"Backend",
       summary.backend + (summary.device_name.empty() ? "" : ", " + summary.device_name)},
      {"Time", duration(total_seconds) + ", iterations " + duration(summary.times.iterate_seconds)},
      {"Memory", byte_size(summary.host_peak_bytes) + " on the host" +
                     (summary.device_peak_bytes > 0
                          ? ", " + byte_size(summary.device_peak_bytes) + " on the device"
                          : "")},
      {"Version", "meshsmooth " + std::string(MESHSMOOTH_VERSION) +
                      (report.server_version.empty() || report.server_version == MESHSMOOTH_VERSION
                           ? ""
                           : ", server " + report.server_version)},
      {"Written", now()}};
  std::string html = definitions_html(rows);
  if (report.message) {
    html += "<details><summary>Options</summary><pre>" +
            escape_html(wire::to_json(report.message->options())) + "</pre></details>";
  }
  return html;
}

/// `Move` succeeds by arriving.
std::optional<Outcome> outcome_of(const std::optional<MotionStats>& motion,
                                  const QualityStats& after) {
  if (!motion || after.inverted_count + after.degenerate_count > 0) return std::nullopt;
  if (motion->reached == 1) return Outcome{"good", "Valid, and the whole motion is reached"};
  return Outcome{"warn", fmt::format("Valid, but only {:.4g} % of the motion is reached",
                                     100 * motion->reached)};
}

/// Elements have the ids of the file, so interface elements are in it, marked.
DrawnMesh drawn_mesh(const CanonicalTopology& canonical, const TopologyView& given,
                     const PositionsView& positions, const std::optional<PositionsView>& before) {
  const std::size_t count = canonical.view().element_count();
  const bool same_ids = count == given.element_count();
  const TopologyView drawn = same_ids ? canonical.view() : given;
  DrawnMesh mesh{drawn, positions, before, SurfaceOrientation(drawn, before.value_or(positions))};
  if (!same_ids) {
    const std::vector<std::uint8_t> none(count, 0);
    mesh.interfaces = canonical.in_caller_order(std::span(none), std::uint8_t{1});
  }
  return mesh;
}

}  // namespace

std::string job_html(const KeptInput& input, const std::filesystem::path& output,
                     const formats::MeshFile& file, const client::SmoothReport& report,
                     const SmoothOptions& options, double total_seconds) {
  const SmoothSummary& summary = report.summary;
  const MeshTopology topology(file.mesh);
  const PositionsView before =
      std::visit([](const auto& p) { return PositionsView(std::span(p)); }, input.positions);
  const CanonicalTopology canonical(topology.view(), before);
  const DrawnMesh mesh = drawn_mesh(canonical, topology.view(), file.mesh.positions_view(), before);
  const auto blocking =
      summary.motion ? summary.motion->blocking_elements : std::vector<std::int64_t>();
  const std::vector<std::uint8_t> fixed = fixed_nodes(file, input.given, options.boundary);
  auto elements = choose_elements(mesh, kMostShownElements, blocking, fixed);
  const bool limited = summary.poor && summary.poor->limited_count > 0;
  const bool told = !limited || mark_limited(mesh, elements, options, fixed);

  const std::string history = history_figures(summary.convergence);
  const Content content{
      .kind =
          summary.motion ? "meshsmooth: report on a motion" : "meshsmooth: report on a smoothing",
      .heading = file_name(input.path) + " → " + file_name(output),
      .findings = describe_findings(report, options, total_seconds,
                                    [&](std::int64_t id) { return file.file_element_id(id); }) +
                  (told ? "" : "which are limited by connectivity is not marked below\n"),
      .before = &summary.quality_before,
      .after = summary.quality_after,
      .history = history.empty() ? ""
                                 : "<section><h2>Convergence</h2><div class=\"metrics\">" +
                                       history + "</div></section>",
      .about = about_job(input, output, report, total_seconds),
      .outcome = outcome_of(summary.motion, summary.quality_after)};
  return make_page(content, mesh, elements, file);
}

std::string quality_html(const std::filesystem::path& path, const formats::MeshFile& file,
                         const QualityStats& stats) {
  const MeshTopology topology(file.mesh);
  const PositionsView positions = file.mesh.positions_view();
  const CanonicalTopology canonical(topology.view(), positions);
  const DrawnMesh mesh = drawn_mesh(canonical, topology.view(), positions, std::nullopt);
  const auto elements = choose_elements(mesh, kMostShownElements, {}, {});
  std::string findings = fmt::format(
      "{} ({}) inverted, {} ({}) degenerate\n", counted(stats.inverted_count, "element"),
      percentage(stats.inverted_count, stats.element_count), with_commas(stats.degenerate_count),
      percentage(stats.degenerate_count, stats.element_count));
  findings += describe_reading(stats, [&](std::int64_t id) { return file.file_element_id(id); });
  findings += describe_volume(stats);
  const Content content{.kind = "meshsmooth: report on the quality of a mesh",
                        .heading = file_name(path),
                        .findings = findings,
                        .after = stats,
                        .about = definitions_html({{"Input", file_name(path)},
                                                   {"Version", "meshsmooth " MESHSMOOTH_VERSION},
                                                   {"Written", now()}})};
  return make_page(content, mesh, elements, file);
}

}  // namespace meshsmooth::cli
