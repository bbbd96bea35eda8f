#include "job_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <optional>
#include <utility>

#include "add_flag.hpp"
#include "interrupt.hpp"
#include "job_mesh.hpp"
#include "locked_elements.hpp"
#include "merged_job.hpp"
#include "meshsmooth/backend_name.hpp"
#include "quality_report.hpp"
#include "readable.hpp"
#include "smooth_options.hpp"
#include "wire/traceparent.hpp"

namespace meshsmooth::cli {
namespace {

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

/// OpenTelemetry's way to tell a program the span that it belongs to; an invalid one is ignored.
std::string caller_span() {
  const char* const text = std::getenv("TRACEPARENT");
  return text != nullptr && wire::is_traceparent(text) ? text : "";
}

client::SmoothReport call_server(formats::MeshFile& file, const JobFlags& flags,
                                 const JobInput& given, const SmoothOptions& options,
                                 const Interrupt& interrupt) {
  Connection connection(flags.server, flags.backend);
  client::RequestOptions request;
  request.request_id = flags.request_id;
  request.traceparent = flags.traceparent.empty() ? caller_span() : flags.traceparent;
  request.shared_memory = false;  // it is not worth its making for one job
  // The embedded server runs only the backend that it was started with.
  if (!flags.server.address.empty()) request.backend = flags.backend;
  if (flags.result_ttl_seconds) {
    request.result_ttl = to_duration("--result-ttl", *flags.result_ttl_seconds);
  }
  const ProgressDisplay::Goal goal{
      iteration_limit(options), displacement_tolerance(options, bounding_box_diagonal(file.mesh))};
  return run_call(flags.output, file, goal, interrupt, std::move(request),
                  [&](const client::RequestOptions& complete) {
                    return connection.client().smooth(file.mesh, options, complete, given);
                  });
}

}  // namespace

formats::MeshFile read_same_elements(const std::filesystem::path& path, const std::string& what,
                                     const std::string& flag, const JobFlags& flags,
                                     const formats::MeshFile& input) {
  check_standard_input(path, flags.input.path);
  formats::MeshFile file = read_mesh(beside(path, flags.input));
  const auto same = [](const ElementBlock& a, const ElementBlock& b) {
    return a.type == b.type && a.nodes == b.nodes;
  };
  if (file.mesh.node_count() == input.mesh.node_count() &&
      std::ranges::equal(file.mesh.blocks, input.mesh.blocks, same)) {
    return file;
  }
  throw InvalidMesh("REFERENCE_DIFFERS",
                    path.string() + " is no " + what + " of " + flags.input.path.string() +
                        ": it must have the same elements of the same nodes, in the same order, in "
                        "other positions",
                    {{"field", flag}});
}

client::SmoothReport run_job(const JobFlags& flags, SmoothOptions options,
                             const CompleteInput& complete) {
  const auto start = std::chrono::steady_clock::now();
  for (const std::string& name : flags.element_quality) {
    options.element_quality_metrics.push_back(find_metric(name).value());
  }
  validate(options);
  if (!flags.server.address.empty() && parse_backend_name(flags.backend)->device) {
    throw InvalidOption("OPTION_MISPLACED",
                        "--backend " + flags.backend +
                            " names a device of this machine, but --server computes elsewhere; "
                            "use --backend cuda",
                        {{"field", "--backend"}});
  }
  const Interrupt interrupt;
  const JobOutput output = checked_outputs(flags.output, flags.input);
  if (!flags.element_quality.empty()) {
    formats::check_writable_with_arrays(output.output.path, source_of(flags.input),
                                        output.output.format);
  }

  formats::MeshFile file = read_mesh(flags.input);
  set_precision(output, file.mesh);
  fix_named_nodes(file, flags);
  const std::vector<NodePair> pairs = find_node_pairs(file, flags);
  JobInput given{.node_pairs = pairs};
  std::optional<formats::CoincidentNodes> coincident;
  if (flags.merge_coincident) coincident.emplace(file.mesh.positions_view());
  complete(file, coincident ? &*coincident : nullptr, given);
  options = with_target_of(std::move(options), given);
  validate(options, given);
  const MeshParts parts = set_up_mesh(file, flags, given, options.boundary);
  interrupt.check();

  KeptInput input = keep_input(output, flags.input.path, file.mesh);
  std::optional<MergedJob> merged;
  if (coincident) merged.emplace(std::move(*coincident), file.mesh, given);
  const client::SmoothReport report = call_server(file, flags, given, options, interrupt);
  if (merged) merged->undo();
  input.given = given;
  write_result(output, input, file, report, options, start);
  if (!output.quiet) std::cout << describe_notes(file) << describe_held_cells(file) << std::flush;
  if (!output.quiet && parts.regions.count > 1) {
    std::cout << counted(static_cast<std::int64_t>(parts.regions.count), "region") << " by "
              << parts.regions.array << ", "
              << counted(report.summary.nodes.between_regions, "node") << " between them\n"
              << std::flush;
  }
  if (!output.quiet && merged && merged->merged_count() > 0) {
    std::cout << counted(merged->merged_count(), "coincident node")
              << " followed another at the same position\n"
              << std::flush;
  }
  if (!output.quiet) {
    std::cout << describe_inner_cells(parts.inner)
              << describe_locked_mesh(file.mesh, report.summary, options) << std::flush;
  }
  return report;
}

void add_job_flags(CLI::App& command, JobFlags& flags, const std::string& input_name) {
  add_input_mesh(command, flags.input, input_name, input_help());
  add_server_flags(command, flags.server, false);
  add_output_flags(command, flags.output);
  command.add_option("--fixed-nodes", flags.fixed_nodes,
                     "File of nodes to fix: a node index (from 0) per line, # comments");
  command
      .add_option("--fixed-set", flags.fixed_sets,
                  "Nodes to fix, by name: a physical group of any dimension, a node or element set "
                  "(Abaqus), a marker (SU2), a patch or zone (OpenFOAM), or a point array of the "
                  "file (not 0: fixed); may be repeated")
      ->allow_extra_args(false);
  add_flag(command, flag::periodic, flags.periodic)
      ->allow_extra_args(false)
      ->type_name("SET_A SET_B");
  add_flag(command, flag::file_pairs, flags.file_pairs)
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  add_flag(command, flag::merge_coincident, flags.merge_coincident);
  std::vector<std::string> types;
  for (const ElementType type : kElementTypes) types.emplace_back(element_name(type));
  add_flag(command, flag::fixed_types, flags.fixed_types)
      ->delimiter(',')
      ->check(CLI::IsMember(types));
  add_flag(command, flag::regions, flags.regions)->capture_default_str();
  std::vector<std::string> metrics;
  for (const QualityMetric metric : kQualityMetrics) metrics.emplace_back(metric_name(metric));
  add_flag(command, flag::element_quality, flags.element_quality)
      ->description(flag::element_quality.help + (". Formats: " + formats::array_extensions()))
      ->delimiter(',')
      ->check(CLI::IsMember(metrics))
      ->allow_extra_args(false);
  add_flag(command, flag::backend, flags.backend)
      ->description(flag::backend.help + (": " + backend_name_list(true)) +
                    "; a device :N only without --server")
      ->check(CLI::Validator(
          [](std::string& name) {
            return parse_backend_name(name) ? std::string()
                                            : name + " is not one of " + backend_name_list(true);
          },
          "{auto,cpu,cuda}"))
      ->capture_default_str();
  add_flag(command, flag::request_id, flags.request_id);
  add_flag(command, flag::traceparent, flags.traceparent);
  add_flag(command, flag::result_ttl, flags.result_ttl_seconds);
}

}  // namespace meshsmooth::cli
