#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "connection.hpp"
#include "fixed_nodes.hpp"
#include "interrupt.hpp"
#include "job_output.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/backend_name.hpp"
#include "node_sets.hpp"
#include "readable.hpp"
#include "regions.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

struct SmoothCommand {
  fs::path input;
  ServerAddress server;
  SmoothFlags smoothing;
  std::optional<fs::path> fixed_nodes;
  std::vector<std::string> fixed_sets;
  std::vector<std::string> fixed_types;
  std::optional<fs::path> reference;
  std::string regions = "auto";
  std::vector<std::string> element_quality;  // names of metrics
  std::string backend = "auto";
  std::optional<double> result_ttl_seconds;
  std::string request_id;
  JobOutput output;
};

double bounding_box_diagonal(const Mesh& mesh) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d lower{kInfinity, kInfinity, kInfinity};
  Vec3d upper{-kInfinity, -kInfinity, -kInfinity};
  std::visit(
      [&](const auto& positions) {
        for (const auto& position : positions) {
          const auto p = vec3_cast<double>(position);
          lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
          upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
        }
      },
      mesh.positions);
  return mesh.node_count() == 0 ? 0 : norm(upper - lower);
}

/// Marks the caller's fixed nodes and those of lower-dimensional cells. With a free boundary the
/// latter follow their nodes.
void fix_nodes(formats::MeshFile& file, const SmoothCommand& command, BoundaryPolicy boundary) {
  const std::size_t node_count = file.mesh.node_count();
  if (boundary == BoundaryPolicy::fixed) {
    mark_fixed(file.mesh.fixed, file.lower_dimensional_nodes(), node_count);
  }
  if (command.fixed_nodes) {
    mark_fixed(file.mesh.fixed, read_fixed_nodes(*command.fixed_nodes, node_count), node_count);
  }
  for (const std::string& name : command.fixed_sets) {
    mark_fixed(file.mesh.fixed, formats::find_node_set(file, name), node_count);
  }
  for (const ElementBlock& block : file.mesh.blocks) {
    const std::string_view type = element_shape(block.type).name;
    if (std::ranges::find(command.fixed_types, type) == command.fixed_types.end()) continue;
    mark_fixed(file.mesh.fixed, block.nodes, node_count);
  }
}

/// The mesh that elements take their shape from; it has the same elements.
std::optional<formats::MeshFile> read_reference(const SmoothCommand& command,
                                                const formats::MeshFile& input) {
  if (!command.reference) {
    const auto& choices = command.smoothing.choices;
    const auto target = choices.find("--target");
    if (target == choices.end() || target->second != "reference") return std::nullopt;
    throw InvalidOption("OPTION_MISPLACED", "--target reference needs --reference FILE",
                        {{"field", "--reference"}});
  }
  formats::MeshFile reference = formats::read_mesh_file(*command.reference);
  const auto same = [](const ElementBlock& a, const ElementBlock& b) {
    return a.type == b.type && a.nodes == b.nodes;
  };
  if (reference.mesh.node_count() != input.mesh.node_count() ||
      !std::ranges::equal(reference.mesh.blocks, input.mesh.blocks, same)) {
    throw InvalidMesh("REFERENCE_DIFFERS",
                      command.reference->string() + " is no reference of " +
                          command.input.string() +
                          ": a reference has the same elements of the same nodes, in the same "
                          "order, in other positions",
                      {{"field", "--reference"}});
  }
  return reference;
}

/// Gives the mesh its regions; with a free boundary they would fix nothing.
formats::Regions set_regions(formats::MeshFile& file, const SmoothCommand& command,
                             BoundaryPolicy boundary) {
  const bool automatic = command.regions == "auto";
  if (command.regions == "none" || (automatic && boundary == BoundaryPolicy::free)) return {};
  if (boundary == BoundaryPolicy::free) {
    throw InvalidOption("OPTION_MISPLACED",
                        "--regions " + command.regions +
                            " means nothing with --boundary free, which frees interfaces too",
                        {{"field", "--regions"}});
  }
  formats::Regions regions =
      automatic ? formats::find_regions(file) : formats::find_regions(file, command.regions);
  file.mesh.regions = std::move(regions.of_element);
  return regions;
}

client::SmoothReport call_server(formats::MeshFile& file, const SmoothCommand& command,
                                 const SmoothOptions& options, const Interrupt& interrupt) {
  Connection connection(command.server, command.backend);
  client::RequestOptions request;
  request.request_id = command.request_id;
  // The embedded server runs only the backend that it was started with.
  if (!command.server.address.empty()) request.backend = command.backend;
  if (command.result_ttl_seconds) {
    request.result_ttl = to_duration("--result-ttl", *command.result_ttl_seconds);
  }
  const ProgressDisplay::Goal goal{
      iteration_limit(options), displacement_tolerance(options, bounding_box_diagonal(file.mesh))};
  return run_call(command.output, file, goal, interrupt, std::move(request),
                  [&](const client::RequestOptions& complete) {
                    return connection.client().smooth(file.mesh, options, complete);
                  });
}

ExitCode run(const SmoothCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  SmoothOptions options = to_smooth_options(command.smoothing);
  for (const std::string& name : command.element_quality) {
    options.element_quality_metrics.push_back(find_metric(name).value());
  }
  validate(options);
  if (!command.server.address.empty() && parse_backend_name(command.backend)->device) {
    throw InvalidOption("OPTION_MISPLACED",
                        "--backend " + command.backend +
                            " names a device of this machine, but --server computes elsewhere; "
                            "use --backend cuda",
                        {{"field", "--backend"}});
  }
  const Interrupt interrupt;
  check_outputs(command.output);
  if (!command.element_quality.empty()) {
    formats::check_writable_with_arrays(command.output.output);
  }

  formats::MeshFile file = formats::read_mesh_file(command.input);
  set_precision(command.output, file.mesh);
  fix_nodes(file, command, options.boundary);
  const formats::Regions regions = set_regions(file, command, options.boundary);
  const std::optional<formats::MeshFile> reference = read_reference(command, file);
  if (reference) {
    options.reference = reference->mesh.positions_view();
    validate(options);
  }
  interrupt.check();

  const client::SmoothReport report = call_server(file, command, options, interrupt);
  write_result(command.output, file, report, options, start);
  if (!command.output.quiet && regions.count > 1) {
    std::cout << counted(static_cast<std::int64_t>(regions.count), "region") << " by "
              << regions.array << ", " << counted(report.summary.nodes.between_regions, "node")
              << " between them\n"
              << std::flush;
  }
  return ExitCode::done;
}

}  // namespace

void add_smooth_command(CLI::App& app, Action& action) {
  // Shared by the options, which fill it, and the action, which runs later.
  auto command = std::make_shared<SmoothCommand>();
  CLI::App* sub = app.add_subcommand("smooth", "Smooth a mesh file");
  sub->add_option("IN", command->input, "Mesh file: " + formats::readable_extensions())->required();
  add_server_flags(*sub, command->server, false);
  add_output_flags(*sub, command->output);
  add_smooth_flags(*sub, command->smoothing);
  sub->add_option("--fixed-nodes", command->fixed_nodes,
                  "File of nodes to fix: a node index (from 0) per line, # comments");
  sub->add_option("--fixed-set", command->fixed_sets,
                  "Nodes to fix, by name: a physical group of any dimension, or a point array of "
                  "the file (not 0: fixed); may be repeated")
      ->allow_extra_args(false);
  std::vector<std::string> types;
  for (const ElementType type : kElementTypes) types.emplace_back(element_shape(type).name);
  sub->add_option("--fixed-types", command->fixed_types,
                  "Element types whose nodes are fixed, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(types));
  sub->add_option("--reference", command->reference,
                  "optimize: mesh file with the same elements, whose shapes they take; what slides "
                  "where is read from it too");
  sub->add_option("--regions", command->regions,
                  "Regions of elements, by a cell array of whole numbers: facets between elements "
                  "of different numbers are kept as the boundary is. auto: physical groups, "
                  "Medit's references, TetGen's first attribute or Gmsh's entities, whichever the "
                  "file has; none: no regions")
      ->capture_default_str();
  std::vector<std::string> metrics;
  for (const QualityMetric metric : kQualityMetrics) metrics.emplace_back(metric_name(metric));
  sub->add_option(
         "--element-quality", command->element_quality,
         "Metrics of the result to write as cell arrays, separated by commas; not a number "
         "(NaN) where an element has no such metric. Formats: " +
             formats::array_extensions())
      ->delimiter(',')
      ->check(CLI::IsMember(metrics))
      ->allow_extra_args(false);
  sub->add_option("--backend", command->backend,
                  "Backend: " + backend_name_list(true) + "; a device :N only without --server")
      ->check([](const std::string& name) {
        return parse_backend_name(name) ? std::string()
                                        : name + " is not one of " + backend_name_list(true);
      })
      ->capture_default_str();
  sub->add_option("--request-id", command->request_id, "UUID of the job [a new one]");
  sub->add_option("--result-ttl", command->result_ttl_seconds,
                  "Time that the server keeps the result for `attach`, in seconds [0]");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
