#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include "commands.hpp"
#include "input_mesh.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/quality.hpp"
#include "quality_report.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::cli {
namespace {

struct QualityCommand {
  std::filesystem::path input;
  std::optional<std::filesystem::path> output;
  bool json = false;
};

void check(const formats::MeshFile& file) {
  try {
    validate(MeshTopology(file.mesh).view(), file.mesh.positions_view());
  } catch (const InvalidMesh& error) {
    throw InvalidMesh(error.reason(), error.what() + place_in_file(error.details(), file),
                      error.details());
  }
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

ExitCode run(const QualityCommand& command) {
  if (command.output) formats::check_writable_with_arrays(*command.output);
  formats::MeshFile file = formats::read_mesh_file(command.input);
  check(file);
  if (command.output) {
    const MeshTopology topology(file.mesh);
    const PositionsView positions = file.mesh.positions_view();
    file.element_quality =
        measure_elements(topology.view(), positions, SurfaceOrientation(topology.view(), positions),
                         metrics_of(file.mesh));
    formats::write_mesh_file(*command.output, file);
  }
  const QualityStats stats = measure_quality(file.mesh);
  if (command.json) {
    SmoothSummary summary;
    summary.quality_before = stats;
    std::cout << wire::to_json(wire::encode_summary(summary).quality_before()) << std::endl;
  } else {
    std::cout << describe_quality(stats, [&](std::int64_t id) { return file.file_element_id(id); })
              << std::flush;
  }
  return ExitCode::done;
}

}  // namespace

void add_quality_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<QualityCommand>();
  CLI::App* sub = app.add_subcommand("quality", "Evaluate the quality of a mesh file");
  sub->add_option("IN", command->input, "Mesh file: " + formats::readable_extensions())->required();
  sub->add_option(
      "-o,--output", command->output,
      "Output file: the mesh with a cell array for each metric: " + formats::array_extensions());
  sub->add_flag("--json", command->json, "Output as meshsmooth.v1.QualityStats in proto3 JSON");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
