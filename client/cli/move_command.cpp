#include <CLI/Option.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "add_flag.hpp"
#include "coincident_nodes.hpp"
#include "commands.hpp"
#include "job_command.hpp"
#include "node_sets.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::cli {
namespace {

struct MoveCommand {
  JobFlags job;
  SmoothFlags moving;
  std::optional<std::filesystem::path> to;
  std::optional<std::string> displacement;  // name of a point array
  std::vector<std::string> prescribed_sets;
};

/// Where all nodes would lie; those of the prescribed ones count.
std::vector<Vec3d> moved_positions(const MoveCommand& command, const formats::MeshFile& file) {
  std::vector<Vec3d> moved;
  const auto append = [&](const auto& positions) {
    for (const auto& position : positions) moved.push_back(vec3_cast<double>(position));
  };
  if (command.to) {
    std::visit(append,
               read_same_elements(*command.to, "motion", "--to", command.job, file).mesh.positions);
    return moved;
  }
  std::visit(append, file.mesh.positions);
  const std::vector<Vec3d> way = formats::find_node_vectors(file, *command.displacement);
  for (std::size_t node = 0; node < moved.size(); ++node) moved[node] += way[node];
  return moved;
}

/// The nodes of the named sets, or those on the boundary that are not fixed by name.
std::vector<NodeId> prescribed_nodes(const MoveCommand& command, const formats::MeshFile& file,
                                     const formats::CoincidentNodes* coincident) {
  std::vector<NodeId> nodes;
  if (command.prescribed_sets.empty()) {
    if (coincident != nullptr) {
      Mesh merged = file.mesh;
      coincident->merge(merged);
      nodes = find_boundary_nodes(MeshTopology(merged).view());
    } else {
      nodes = find_boundary_nodes(MeshTopology(file.mesh).view());
    }
    const auto& fixed = file.mesh.fixed;
    std::erase_if(nodes, [&](NodeId node) {
      return !fixed.empty() && fixed[static_cast<std::size_t>(node)] != 0;
    });
  }
  for (const std::string& name : command.prescribed_sets) {
    const std::vector<NodeId> set = formats::find_node_set(file, name);
    nodes.insert(nodes.end(), set.begin(), set.end());
  }
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

ExitCode run(const MoveCommand& command) {
  if (command.to.has_value() == command.displacement.has_value()) {
    throw InvalidOption("OPTION_MISPLACED",
                        "move needs one of --to FILE and --displacement ARRAY: where the boundary "
                        "shall lie",
                        {{"field", "--to"}});
  }
  std::vector<NodeId> nodes;
  std::vector<Vec3d> positions;
  const client::SmoothReport report =
      run_job(command.job, to_smooth_options(command.moving),
              [&](const formats::MeshFile& file, const formats::CoincidentNodes* coincident,
                  JobInput& input) {
                const std::vector<Vec3d> moved = moved_positions(command, file);
                nodes = prescribed_nodes(command, file, coincident);
                for (const NodeId node : nodes) {
                  positions.push_back(moved[static_cast<std::size_t>(node)]);
                }
                input.prescribed = {nodes, std::span<const Vec3d>(positions)};
              });
  const std::optional<MotionStats>& motion = report.summary.motion;
  // A server that does not say how far it came has not promised the whole of it.
  return motion && motion->reached == 1 ? ExitCode::done : ExitCode::incomplete;
}

}  // namespace

void add_move_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<MoveCommand>();
  command->moving.method = method_name(Move{});
  CLI::App* sub = app.add_subcommand(
      "move", "Deform a mesh file to new boundary positions, keeping every element valid");
  add_job_flags(*sub, command->job, "REFERENCE");
  add_move_flags(*sub, command->moving);
  CLI::Option* to = add_flag(*sub, flag::to, command->to);
  add_flag(*sub, flag::displacement, command->displacement)->excludes(to);
  sub->add_option("--prescribed-set", command->prescribed_sets,
                  "Prescribed nodes, by name, as --fixed-set; may be repeated [the boundary]")
      ->allow_extra_args(false);
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
