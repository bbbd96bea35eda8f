#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>

#include "commands.hpp"
#include "generate.hpp"
#include "mesh_file.hpp"
#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

struct GenerateCommand {
  std::string shape;
  std::size_t node_count = 10000;
  std::uint64_t seed = 1;
  double tangle = 0;
  std::filesystem::path output;
};

using Generator = Mesh (*)(std::size_t, std::uint64_t, double);
const std::map<std::string, Generator> kGenerators = {
    {"cube", formats::generate_cube},   {"slope", formats::generate_slope},
    {"mixed", formats::generate_mixed}, {"square", formats::generate_square},
    {"ball", formats::generate_ball},   {"pipe", formats::generate_pipe}};

ExitCode run(const GenerateCommand& command) {
  formats::check_writable(command.output);
  const formats::MeshFile file(
      kGenerators.at(command.shape)(command.node_count, command.seed, command.tangle));
  formats::write_mesh_file(command.output, file);
  std::cout << command.output.string() << ": "
            << counted(static_cast<std::int64_t>(file.mesh.node_count()), "node");
  for (const ElementBlock& block : file.mesh.blocks) {
    const ElementShape& shape = element_shape(block.type);
    const auto count = static_cast<std::int64_t>(block.nodes.size()) / shape.node_count;
    std::cout << ", " << with_commas(count) << " x " << shape.name;
  }
  std::cout << std::endl;
  return ExitCode::done;
}

}  // namespace

void add_generate_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<GenerateCommand>();
  CLI::App* sub = app.add_subcommand("generate", "Make a test mesh, the same for the same seed");
  sub->add_option("SHAPE", command->shape,
                  "cube (of the paper) | slope | mixed (all volume elements) | square (triangles) "
                  "| ball | pipe (tetrahedra with curved sides)")
      ->required()
      ->check(CLI::IsMember({"cube", "slope", "mixed", "square", "ball", "pipe"}));
  sub->add_option("--nodes", command->node_count, "Number of nodes")->capture_default_str();
  sub->add_option("--seed", command->seed, "Of the random positions")->capture_default_str();
  sub->add_option("--tangle", command->tangle, "About this share of the elements is inverted")
      ->capture_default_str();
  sub->add_option("-o,--output", command->output,
                  "Where it goes: " + formats::writable_extensions())
      ->required();
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
