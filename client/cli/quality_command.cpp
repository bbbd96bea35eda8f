#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <ostream>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "element_table.hpp"
#include "html_report.hpp"
#include "input_mesh.hpp"
#include "mesh_argument.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "meshsmooth/quality.hpp"
#include "quality_report.hpp"
#include "text_file.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::cli {
namespace {

struct QualityCommand {
  MeshArgument input;
  std::optional<std::filesystem::path> output;
  std::string output_format;
  std::optional<std::filesystem::path> html;
  bool json = false;
  ElementTableFlags table;
};

void check(const formats::MeshFile& file) {
  try {
    const MeshTopology topology(file.mesh);
    validate(CanonicalTopology(topology.view()).view(), file.mesh.positions_view());
  } catch (const InvalidMesh& error) {
    throw InvalidMesh(error.reason(), error.what() + place_in_file(error.details(), file),
                      error.details());
  }
}

/// The metrics that the mesh has beside those of reports, as cell arrays.
void add_arrays(formats::MeshFile& file, const ElementTable& table) {
  for (std::size_t m = 0; m < table.metrics.size(); ++m) {
    if (!std::holds_alternative<ShapeMetric>(table.metrics[m])) continue;
    file.element_arrays.push_back({std::string(element_metric_name(table.metrics[m])),
                                   {table.columns[m].begin(), table.columns[m].end()}});
  }
}

/// Evaluates the requirements and reports them: exit code 6 unless all are met.
ExitCode report_requirements(const std::vector<Requirement>& requirements,
                             const ElementTable& table, const formats::MeshFile& file,
                             std::ostream& to) {
  std::string text;
  std::size_t not_met = 0;
  for (const Requirement& requirement : requirements) {
    const RequirementResult result = evaluate(requirement, table);
    text += describe_requirement(requirement, result, file);
    if (!result.met) ++not_met;
  }
  to << text << std::flush;
  if (not_met == 0) return ExitCode::done;
  std::cerr << "meshsmooth: " << not_met << " of " << requirements.size() << " requirements not met"
            << std::endl;
  return ExitCode::incomplete;
}

/// All that some element of the mesh has.
std::vector<QualityMetric> metrics_of(const Mesh& mesh) {
  std::vector<QualityMetric> metrics;
  for (const QualityMetric metric : kQualityMetrics) {
    const auto has = [&](const ElementBlock& block) { return has_metric(block.type, metric); };
    if (std::ranges::any_of(mesh.blocks, has)) metrics.push_back(metric);
  }
  return metrics;
}

/// What names standard output has it for itself.
void keep_output_of(const QualityCommand& command) {
  std::vector<std::pair<std::string, std::filesystem::path>> outputs;
  const auto add = [&](const char* flag, const std::optional<std::filesystem::path>& path) {
    if (path) outputs.emplace_back(flag, *path);
  };
  add("--output", command.output);
  add("--html", command.html);
  add("--csv", command.table.csv);
  add("--npz", command.table.npz);
  add("--elements-json", command.table.json);
  keep_standard_output(outputs);
}

ExitCode run(const QualityCommand& command) {
  const MeshArgument output = output_beside(
      {command.output.value_or(std::filesystem::path()), command.output_format}, command.input);
  if (command.output) {
    formats::check_writable_with_arrays(output.path, source_of(command.input), output.format);
  }
  const std::vector<Requirement> requirements = check_element_table(command.table);
  if (command.html) check_text_file_writable(*command.html);
  keep_output_of(command);
  formats::MeshFile file = read_mesh(command.input);
  check(file);
  const QualityStats stats = measure_quality(file.mesh);
  ElementTable table;
  if (command.table.any()) {
    table = measure_table(file.mesh, table_metrics(command.table, requirements, file.mesh));
  }
  if (command.output) {
    const MeshTopology topology(file.mesh);
    const PositionsView positions = file.mesh.positions_view();
    const CanonicalTopology canonical(topology.view(), positions);
    file.element_quality =
        measure_elements(canonical.view(), positions,
                         SurfaceOrientation(canonical.view(), positions), metrics_of(file.mesh));
    canonical.complete(file.element_quality);
    add_arrays(file, table);
    formats::write_mesh_file(output.path, file, output.format);
  }
  write_element_table(command.table, file, table);
  if (command.html) write_text_file(*command.html, quality_html(command.input.path, file, stats));
  if (command.json) {
    SmoothSummary summary;
    summary.quality_before = stats;
    std::string json = wire::to_json(wire::encode_summary(summary).quality_before());
    if (!command.table.metrics.empty()) {
      json.insert(json.rfind('}'), "," + table_json(table));
    }
    std::cout << json << std::endl;
  } else {
    std::cout << describe_quality(stats, [&](std::int64_t id) { return file.file_element_id(id); })
              << describe_notes(file) << describe_held_cells(file) << describe_table(table)
              << (requirements.empty() ? "" : "\n") << std::flush;
  }
  return report_requirements(requirements, table, file, command.json ? std::cerr : std::cout);
}

}  // namespace

void add_quality_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<QualityCommand>();
  CLI::App* sub = app.add_subcommand("quality", "Evaluate the quality of a mesh file");
  add_input_mesh(*sub, command->input, "IN", input_help());
  sub->add_option("-o,--output", command->output,
                  "Output file: the mesh with a cell array for each metric: " +
                      output_help(formats::array_extensions()));
  add_output_format(*sub, command->output_format);
  sub->add_flag("--json", command->json,
                "Output as meshsmooth.v1.QualityStats in proto3 JSON, with --metrics also "
                "shape_metrics and faces; requirements are reported on the error output");
  sub->add_option("--html", command->html,
                  "Output file of an HTML report with an interactive view");
  add_element_table_flags(*sub, command->table);
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
