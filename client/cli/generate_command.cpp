#include <CLI/Formatter.hpp>
#include <CLI/Option.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "generate_shapes.hpp"
#include "mesh_argument.hpp"
#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

ExitCode run(const MeshArgument& output, const std::function<formats::MeshFile()>& make) {
  formats::check_writable(output.path, {}, output.format);
  keep_standard_output({{"--output", output.path}});
  const formats::MeshFile file = make();
  formats::write_mesh_file(output.path, file, output.format);
  std::cout << output.path.string() << ": "
            << counted(static_cast<std::int64_t>(file.mesh.node_count()), "node");
  for (const ElementBlock& block : file.mesh.blocks) {
    const std::size_t count = block.nodes.size() / element_width(block.type);
    std::cout << ", " << with_commas(static_cast<std::int64_t>(count)) << " x "
              << element_name(block.type);
  }
  std::cout << std::endl;
  return ExitCode::done;
}

/// The help of `generate` itself.
class ShapesFormatter : public CLI::Formatter {
 public:
  std::string make_usage(const CLI::App*, std::string name) const override {
    return "Usage: " + name + " SHAPE [OPTIONS]\n";
  }
};

/// The names of the commands below this one, "bar, hub".
std::string names_below(const CLI::App& command) {
  std::string names;
  for (const CLI::App* below : command.get_subcommands({})) {
    names += (names.empty() ? "" : ", ") + below->get_name();
  }
  return names;
}

}  // namespace

CLI::App& ShapeCommands::add(const std::string& shape, const std::string& description,
                             std::function<formats::MeshFile()> make) {
  CLI::App* sub = generate_.add_subcommand(shape, description);
  auto output = std::make_shared<MeshArgument>();
  sub->add_option("-o,--output", output->path,
                  "Where it goes: " + output_help(formats::writable_extensions()))
      ->required();
  add_output_format(*sub, output->format);
  sub->callback([&action = action_, output, make = std::move(make)] {
    action = [output, make] { return run(*output, make); };
  });
  return *sub;
}

void add_generate_command(CLI::App& app, Action& action) {
  CLI::App* sub = app.add_subcommand(
      "generate", "Generate a reproducible test mesh; SHAPE --help lists its options");
  sub->require_subcommand(1);
  ShapeCommands commands(*sub, action);
  add_random_shapes(commands);
  add_case_shapes(commands);
  sub->formatter(std::make_shared<ShapesFormatter>());  // not of the shapes, which are there
  // Takes what is no shape, to name the shapes in the error.
  sub->add_option("SHAPE")->group("")->check([sub](const std::string& word) -> std::string {
    throw CLI::InvalidError("no shape " + word + "; there are " + names_below(*sub),
                            CLI::ExitCodes::InvalidError);
  });
}

}  // namespace meshsmooth::cli
