#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "compare.hpp"
#include "input_mesh.hpp"
#include "mesh_argument.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "meshsmooth/quality.hpp"
#include "readable.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::cli {
namespace {

struct CompareCommand {
  MeshArgument before;
  std::filesystem::path after;
  bool json = false;
};

/// Distances between the same nodes of two files, in the mesh's unit.
struct Displacements {
  std::int64_t moved = 0;  // nodes with other coordinates
  double largest = 0;
  double mean = 0;  // over the moved ones
  NodeId farthest = 0;
  Vec3d from{}, to{};  // of the farthest
};

std::vector<Vec3d> positions_of(const Mesh& mesh) {
  std::vector<Vec3d> positions;
  const auto add = [&](const auto& all) {
    for (const auto& position : all) positions.push_back(vec3_cast<double>(position));
  };
  std::visit(add, mesh.positions);
  return positions;
}

/// None where the meshes do not have as many nodes.
std::optional<Displacements> displacements(const Mesh& before, const Mesh& after) {
  const std::vector<Vec3d> from = positions_of(before), to = positions_of(after);
  if (from.size() != to.size()) return std::nullopt;
  Displacements result;
  double sum = 0;
  for (std::size_t node = 0; node < from.size(); ++node) {
    if (from[node] == to[node]) continue;
    const double distance = norm(to[node] - from[node]);
    ++result.moved;
    sum += distance;
    if (distance > result.largest) {
      result.largest = distance;
      result.farthest = static_cast<NodeId>(node);
      result.from = from[node];
      result.to = to[node];
    }
  }
  if (result.moved > 0) result.mean = sum / static_cast<double>(result.moved);
  return result;
}

struct Quality {
  QualityStats before, after;
};

/// With the same topology, surface elements count as inverted against the first mesh.
Quality measure(const Mesh& before, const Mesh& after, bool same_topology) {
  if (!same_topology) return {measure_quality(before), measure_quality(after)};
  const MeshTopology topology(before);
  const CanonicalTopology canonical(topology.view(), before.positions_view());
  const SurfaceOrientation orientation(canonical.view(), before.positions_view());
  const auto measure_at = [&](const PositionsView& positions) {
    QualityStats stats = measure_quality(canonical.view(), positions, orientation);
    canonical.complete(stats);
    return stats;
  };
  return {measure_at(before.positions_view()), measure_at(after.positions_view())};
}

std::string point(Vec3d p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

std::string describe_nodes(const std::optional<Displacements>& moves,
                           const formats::MeshFile& before) {
  if (!moves) return "nodes     not compared: the files do not have as many\n";
  const auto total = static_cast<std::int64_t>(before.mesh.node_count());
  if (moves->moved == 0) return fmt::format("nodes     none of {} moved\n", with_commas(total));
  return fmt::format(
      "nodes     {} of {} moved: max {:.6g}, mean {:.6g}\n"
      "          farthest is node {}, from {} to {}\n",
      with_commas(moves->moved), with_commas(total), moves->largest, moves->mean,
      before.file_node_id(moves->farthest), point(moves->from), point(moves->to));
}

std::string describe_quality(const Quality& quality) {
  std::string text =
      fmt::format("\n{:<19} {:>21} {:>21} {:>21} {:>21}\n", "", "min", "1 %", "mean", "max");
  for (const MetricStats& own : quality.before.metrics) {
    const auto other = std::ranges::find(quality.after.metrics, own.metric, &MetricStats::metric);
    if (other == quality.after.metrics.end()) continue;
    std::string name(metric_name(own.metric));
    std::ranges::replace(name, '_', ' ');
    const auto change = [](double from, double to) {
      return fmt::format("{:>9.4f} -> {:>8.4f}", from, to);
    };
    text += fmt::format("{:<19} {} {} {} {}\n", name, change(own.min, other->min),
                        change(own.percentile_1, other->percentile_1),
                        change(own.mean, other->mean), change(own.max, other->max));
  }
  return text + fmt::format("inverted {} -> {}, degenerate {} -> {}\n",
                            with_commas(quality.before.inverted_count),
                            with_commas(quality.after.inverted_count),
                            with_commas(quality.before.degenerate_count),
                            with_commas(quality.after.degenerate_count));
}

std::string conclusion(const formats::FileDifference& difference,
                       const std::optional<Displacements>& moves) {
  const bool moved = !moves || moves->moved > 0;
  switch (difference.compared_by) {
    case formats::ComparedBy::bytes:
      return moved ? "only coordinates differ: all other bytes are equal"
                   : "all bytes are equal "
                     "but for the spelling of coordinates";
    case formats::ComparedBy::arrays:
      return std::string(moved ? "only coordinates differ" : "nothing differs") +
             ": cells, arrays, ids, groups and sets are equal";
    case formats::ComparedBy::meshes:
      return std::string(moved ? "only coordinates differ" : "nothing differs") +
             " between the meshes; the files have different formats and carry more than this";
  }
  return {};
}

std::string describe(const formats::FileDifference& difference,
                     const std::optional<Displacements>& moves) {
  std::string text =
      fmt::format("topology  {}\n", difference.same_topology ? "the same" : "differs");
  if (difference.only_coordinates())
    return text + "files     " + conclusion(difference, moves) + "\n";
  text += fmt::format("files     differ in more than coordinates, compared by {}:\n",
                      formats::compared_by_name(difference.compared_by));
  for (const std::string& what : difference.differences) text += "  " + what + "\n";
  return text;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x20) {
      result += fmt::format("\\u{:04x}", code);
      continue;
    }
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

std::string json_of(const QualityStats& stats) {
  SmoothSummary summary;
  summary.quality_before = stats;
  return wire::to_json(wire::encode_summary(summary).quality_before());
}

std::string as_json(const formats::FileDifference& difference,
                    const std::optional<Displacements>& moves, const formats::MeshFile& before,
                    const Quality& quality) {
  std::string list;
  for (const std::string& what : difference.differences) {
    list += (list.empty() ? "" : ", ") + quoted(what);
  }
  std::string nodes = "null";
  if (moves) {
    nodes = fmt::format("{{\"total\": {}, \"moved\": {}, \"max\": {}, \"mean\": {}",
                        before.mesh.node_count(), moves->moved, moves->largest, moves->mean);
    if (moves->moved > 0) {
      nodes += fmt::format(
          ", \"farthest\": {{\"id\": {}, \"from\": [{}, {}, {}], \"to\": [{}, {}, {}]}}",
          before.file_node_id(moves->farthest), moves->from.x, moves->from.y, moves->from.z,
          moves->to.x, moves->to.y, moves->to.z);
    }
    nodes += "}";
  }
  return fmt::format(
      "{{\"only_coordinates\": {},\n\"compared_by\": \"{}\",\n\"same_topology\": {},\n"
      "\"differences\": [{}],\n\"nodes\": {},\n\"quality_before\": {},\n\"quality_after\": {}}}",
      difference.only_coordinates(), formats::compared_by_name(difference.compared_by),
      difference.same_topology, list, nodes, json_of(quality.before), json_of(quality.after));
}

formats::MeshFile read(const MeshArgument& input) {
  formats::MeshFile file = read_mesh(input);
  try {
    const MeshTopology topology(file.mesh);
    validate(CanonicalTopology(topology.view()).view(), file.mesh.positions_view());
  } catch (const InvalidMesh& error) {
    throw InvalidMesh(
        error.reason(),
        input.path.string() + ": " + error.what() + place_in_file(error.details(), file),
        error.details());
  }
  return file;
}

ExitCode run(const CompareCommand& command) {
  check_standard_input(command.before.path, command.after);
  const formats::MeshFile before = read(command.before);
  const formats::MeshFile after = read(beside(command.after, command.before));
  const formats::FileDifference difference = formats::compare_files(before, after);
  const std::optional<Displacements> moves = displacements(before.mesh, after.mesh);
  const Quality quality = measure(before.mesh, after.mesh, difference.same_topology);
  if (command.json) {
    std::cout << as_json(difference, moves, before, quality) << std::endl;
  } else {
    std::cout << describe(difference, moves) << describe_nodes(moves, before)
              << describe_quality(quality) << std::flush;
  }
  if (difference.only_coordinates()) return ExitCode::done;
  std::cerr << "meshsmooth: " << command.before.path.string() << " and " << command.after.string()
            << " differ in more than coordinates: " << difference.differences.front() << std::endl;
  return ExitCode::incomplete;
}

}  // namespace

void add_compare_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<CompareCommand>();
  CLI::App* sub = app.add_subcommand(
      "compare",
      "Compare two mesh files: which nodes moved, how the quality changed, whether anything else "
      "did (exit code 6)");
  add_input_mesh(*sub, command->before, "BEFORE", input_help());
  sub->add_option("AFTER", command->after, "Mesh file")->required();
  sub->add_flag("--json", command->json, "Output as JSON");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
