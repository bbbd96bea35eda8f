#include <unistd.h>

#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <vector>

#include "commands.hpp"
#include "connection.hpp"
#include "fixed_nodes.hpp"
#include "input_mesh.hpp"
#include "interrupt.hpp"
#include "mesh_file.hpp"
#include "node_sets.hpp"
#include "progress_display.hpp"
#include "readable.hpp"
#include "regions.hpp"
#include "smooth_options.hpp"
#include "text_file.hpp"
#include "verdict.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

struct SmoothCommand {
  fs::path input;
  fs::path output;
  ServerAddress server;
  SmoothFlags smoothing;
  std::optional<fs::path> fixed_nodes;
  std::vector<std::string> fixed_sets;
  std::string regions = "auto";
  std::string backend = "auto";
  std::optional<std::string> precision;
  std::optional<fs::path> report;
  std::optional<double> timeout_seconds;
  std::string request_id;
  bool quiet = false;
};

/// Positions in the precision asked for; they travel and are computed in it.
void set_precision(Mesh& mesh, const std::string& precision) {
  const auto convert = [&mesh]<class To, class From>(To, const std::vector<From>& positions) {
    std::vector<To> converted(positions.size());
    std::ranges::transform(positions, converted.begin(),
                           [](From position) { return vec3_cast<decltype(To::x)>(position); });
    mesh.positions = std::move(converted);
  };
  const auto* as_double = std::get_if<std::vector<Vec3d>>(&mesh.positions);
  const auto* as_float = std::get_if<std::vector<Vec3f>>(&mesh.positions);
  if (precision == "f32" && as_double) convert(Vec3f{}, std::vector<Vec3d>(*as_double));
  if (precision == "f64" && as_float) convert(Vec3d{}, std::vector<Vec3f>(*as_float));
}

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

/// A sweep in which no node moves as far as this is the last; 0: no such rule.
double least_move(const Mesh& mesh, const SmoothOptions& options) {
  if (converges_by_energy(options)) return 0;
  if (!options.tolerance.relative) return options.tolerance.value;
  return options.tolerance.value * bounding_box_diagonal(mesh);
}

/// The caller's fixed nodes, and those that hold the elements of a lower
/// dimension in place. With a free boundary the latter follow their nodes.
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
}

/// Gives the mesh its regions; with a free boundary these would keep nothing in place.
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

void check_outputs(const SmoothCommand& command) {
  formats::check_writable(command.output);
  if (!command.report) return;
  if (fs::absolute(*command.report).lexically_normal() ==
      fs::absolute(command.output).lexically_normal()) {
    throw InvalidOption("OPTION_MISPLACED", "--report and --output name the same file",
                        {{"field", "--report"}});
  }
  check_text_file_writable(*command.report);
}

client::SmoothReport call_server(formats::MeshFile& file, const SmoothCommand& command,
                                 const SmoothOptions& options, const Interrupt& interrupt) {
  Connection connection(command.server, command.backend);
  ProgressDisplay display(std::cerr, ::isatty(STDERR_FILENO) == 1,
                          {options.max_iterations, least_move(file.mesh, options)});
  client::RequestOptions request;
  request.request_id = command.request_id;
  // The server inside runs nothing but the backend it was started with.
  request.backend = !command.server.address.empty() ? command.backend : "auto";
  request.stop = interrupt.token();
  if (command.timeout_seconds) {
    request.timeout = to_duration("--timeout", *command.timeout_seconds);
  }
  if (!command.quiet) {
    request.on_progress = [&](const client::JobProgress& progress) { display.show(progress); };
  }
  try {
    client::SmoothReport report = connection.client().smooth(file.mesh, options, request);
    display.finish();
    return report;
  } catch (const client::ServiceError& error) {
    display.finish();
    throw client::ServiceError(error.code(), error.reason(),
                               error.what() + place_in_file(error.details(), file), error.details(),
                               error.hint());
  }
}

ExitCode run(const SmoothCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  const SmoothOptions options = to_smooth_options(command.smoothing);
  if (!command.server.address.empty() && command.backend.starts_with("cuda:")) {
    throw InvalidOption("OPTION_MISPLACED",
                        "--backend " + command.backend +
                            " names a device of this machine, but --server computes elsewhere; "
                            "use --backend cuda",
                        {{"field", "--backend"}});
  }
  const Interrupt interrupt;
  check_outputs(command);

  formats::MeshFile file = formats::read_mesh_file(command.input);
  if (command.precision) set_precision(file.mesh, *command.precision);
  fix_nodes(file, command, options.boundary);
  const formats::Regions regions = set_regions(file, command, options.boundary);
  interrupt.check();

  const client::SmoothReport report = call_server(file, command, options, interrupt);
  const std::string json = command.report ? report.to_json() : "";  // first, should it have none
  formats::write_mesh_file(command.output, file);
  if (command.report) write_text_file(*command.report, json);
  if (!command.quiet) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    std::cout << describe_verdict(report, options, elapsed.count(),
                                  [&](std::int64_t id) { return file.file_element_id(id); });
    if (regions.count > 1) {
      std::cout << counted(static_cast<std::int64_t>(regions.count), "region") << " by "
                << regions.array << ", " << counted(report.summary.nodes.between_regions, "node")
                << " between them\n";
    }
    std::cout << std::flush;
  }
  return ExitCode::done;
}

}  // namespace

void add_smooth_command(CLI::App& app, Action& action) {
  // Shared by the options, which fill it, and the action, which runs later.
  auto command = std::make_shared<SmoothCommand>();
  CLI::App* sub = app.add_subcommand("smooth", "Smooth a mesh file");
  sub->add_option("IN", command->input, "Mesh: " + formats::readable_extensions())->required();
  sub->add_option("-o,--output", command->output,
                  "Where it goes: " + formats::writable_extensions())
      ->required();
  add_server_flags(*sub, command->server, false);
  add_smooth_flags(*sub, command->smoothing);
  sub->add_option("--fixed-nodes", command->fixed_nodes,
                  "File of nodes to hold: a node index (from 0) a line, # comments");
  sub->add_option("--fixed-set", command->fixed_sets,
                  "Nodes to hold by name: a physical group of any dimension, or a point array of "
                  "the file (not 0: held); may be repeated")
      ->allow_extra_args(false);
  sub->add_option("--regions", command->regions,
                  "Cell array of whole numbers by name: facets between elements of different "
                  "numbers are kept as the boundary is. auto: physical groups, Medit's "
                  "references, TetGen's first attribute or Gmsh's entities, whichever the file "
                  "has; none: no regions")
      ->capture_default_str();
  sub->add_option("--backend", command->backend,
                  "What computes: auto, cpu, cuda; without --server also cuda:N")
      ->check([](const std::string& name) {
        return name == "auto" || name == "cpu" || name == "cuda" || name.starts_with("cuda:")
                   ? std::string()
                   : name + " is none of auto, cpu, cuda, cuda:N";
      })
      ->capture_default_str();
  sub->add_option("--precision", command->precision,
                  "Of coordinates on the way, in computing and in the output [the file's]")
      ->check(CLI::IsMember({"f32", "f64"}));
  sub->add_option("--report", command->report, "Write the whole summary as JSON");
  sub->add_option("--timeout", command->timeout_seconds, "Seconds for the whole call")
      ->check(CLI::Range(1e-3, 1e9));
  sub->add_option("--request-id", command->request_id, "A UUID of your own [a new one]");
  sub->add_flag("--quiet", command->quiet, "Print errors only");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
