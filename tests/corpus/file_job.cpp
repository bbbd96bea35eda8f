#include "file_job.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "compare.hpp"
#include "content.hpp"
#include "dataset.hpp"
#include "exit_code.hpp"
#include "input_mesh.hpp"
#include "job_mesh.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/quality.hpp"
#include "meshsmooth/smoother.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::corpus {
namespace {

namespace fs = std::filesystem;

/// The cells of the file by type, in whatever dimension.
JsonLine count_cells(const formats::MeshFile& file) {
  std::map<std::string, long long> counts;
  const auto dataset = formats::dataset_of(file);
  formats::Cell cell;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    const bool own = cell.type >= formats::kFirstOwnCellType;
    ++counts[own ? dataset->cell_name(cell.type) : std::to_string(cell.type)];
  }
  JsonLine line;
  for (const auto& [type, count] : counts) line.add(type, count);
  return line;
}

JsonLine describe(const formats::MeshFile& file) {
  JsonLine line;
  line.add("step", "read");
  line.add("nodes", static_cast<long long>(formats::dataset_of(file)->node_count()));
  line.add("elements", static_cast<long long>(file.mesh.element_count()));
  line.add("lower_dimensional", static_cast<long long>(file.lower_dimensional_cell_count()));
  JsonLine held;
  for (const formats::HeldCells& cells : file.held_cells()) {
    held.add(cells.name, static_cast<long long>(cells.count));
  }
  line.add("held", held);
  line.add("cells", count_cells(file));
  return line;
}

void add_quality(JsonLine& line, const QualityStats& stats) {
  line.add("inverted", static_cast<long long>(stats.inverted_count));
  line.add("degenerate", static_cast<long long>(stats.degenerate_count));
  line.add("volume", stats.sum_absolute_volume);
  for (const MetricStats& metric : stats.metrics) {
    if (metric.metric != QualityMetric::mean_ratio &&
        metric.metric != QualityMetric::scaled_jacobian) {
      continue;
    }
    const std::string name(metric_name(metric.metric));
    line.add(name + "_min", metric.min);
    line.add(name + "_mean", metric.mean);
  }
}

JsonLine measure(const formats::MeshFile& file) {
  const MeshTopology topology(file.mesh);
  const PositionsView positions = file.mesh.positions_view();
  validate(topology.view(), positions);
  JsonLine line;
  line.add("step", "quality");
  add_quality(line, measure_quality(topology.view(), positions,
                                    SurfaceOrientation(topology.view(), positions)));
  return line;
}

/// As `smooth FILE -o RESULT` does it, but for the server between. `said`: whether the summary has
/// a line on what is worse than before.
JsonLine smooth(formats::MeshFile& file, const cli::SmoothFlags& flags, JsonLine line = {}) {
  const SmoothOptions options = cli::to_smooth_options(flags);
  const std::vector<NodePair> pairs = file.node_pairs();
  const JobInput input{.node_pairs = pairs};
  cli::set_up_mesh(file, {}, input, options.boundary);
  const SmoothSummary summary = make_smoother("cpu", 1)->smooth(file.mesh, options, {}, input);
  line.add("moved", static_cast<long long>(summary.nodes.moved));
  const KeptQuality kept = summary.kept_quality.value_or(KeptQuality{});
  line.add("restored", static_cast<long long>(kept.restored_node_count()));
  line.add("said", !find_lower(summary).empty());
  add_quality(line, summary.quality_after);
  JsonLine before;
  add_quality(before, summary.quality_before);
  line.add("before", before);
  return line;
}

/// The settings beside the defaults by which no result may be worse than its input.
std::vector<std::pair<std::string, cli::SmoothFlags>> other_settings() {
  cli::SmoothFlags worst, smart, slide;
  worst.choices["--goal"] = "worst";
  smart.method = "smart-laplacian";
  slide.boundary = "slide";
  return {{"worst", worst}, {"smart-laplacian", smart}, {"slide", slide}};
}

/// One object by setting; what a setting refuses has its reason.
JsonLine smooth_otherwise(const fs::path& path) {
  JsonLine line;
  line.add("step", "settings");
  for (const auto& [name, flags] : other_settings()) {
    try {
      formats::MeshFile file = formats::read_mesh_file(path);
      line.add(name, smooth(file, flags));
    } catch (const Error& error) {
      JsonLine refused;
      refused.add("reason", std::string(error.reason()));
      line.add(name, refused);
    }
  }
  return line;
}

JsonLine compare(const formats::MeshFile& before, const formats::MeshFile& after) {
  const formats::FileDifference difference = formats::compare_files(before, after);
  JsonLine line;
  line.add("step", "compare");
  line.add("by", formats::compared_by_name(difference.compared_by));
  line.add("only_coordinates", difference.only_coordinates());
  if (!difference.only_coordinates()) line.add("difference", difference.differences.front());
  return line;
}

/// The folder of an OpenFOAM mesh lies in its case.
fs::path result_path(const fs::path& file, const fs::path& folder) {
  return fs::is_directory(file) ? folder / "case.foam" : folder / file.filename();
}

}  // namespace

void run_file(const fs::path& file, const fs::path& folder,
              const std::function<void(const JsonLine&)>& report) {
  std::string step = "read";
  formats::MeshFile mesh;
  try {
    fs::create_directories(folder);
    mesh = formats::read_mesh_file(file);
    report(describe(mesh));
    step = "quality";
    report(measure(mesh));
    step = "smooth";
    JsonLine smoothed;
    smoothed.add("step", step);
    report(smooth(mesh, {}, smoothed));
    step = "settings";
    report(smooth_otherwise(file));
    step = "write";
    const fs::path result = result_path(file, folder);
    formats::write_mesh_file(result, mesh);
    step = "compare";
    report(compare(formats::read_mesh_file(file), formats::read_mesh_file(result)));
  } catch (const std::exception& error) {
    const auto* ours = dynamic_cast<const Error*>(&error);
    JsonLine line;
    line.add("step", step);
    line.add("reason", ours != nullptr ? ours->reason() : std::string("INTERNAL"));
    line.add("error", cli::error_line(error) +
                          (ours != nullptr ? cli::place_in_file(ours->details(), mesh) : ""));
    report(line);
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

}  // namespace meshsmooth::corpus
