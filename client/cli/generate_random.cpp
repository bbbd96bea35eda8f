#include <CLI/Option.hpp>
#include <memory>

#include "generate/cases.hpp"
#include "generate/generate.hpp"
#include "generate_shapes.hpp"

namespace meshsmooth::cli {
namespace {

struct RandomFlags {
  std::size_t node_count = 10000;
  std::uint64_t seed = 1;
  double tangle = 0;
  formats::CubeMotion motion;
};

using Generator = Mesh (*)(std::size_t, std::uint64_t, double);

CLI::App& add_random(ShapeCommands& commands, const std::string& shape,
                     const std::string& description, Generator generate,
                     const std::shared_ptr<RandomFlags>& flags) {
  CLI::App& command = commands.add(shape, description, [generate, flags] {
    Mesh mesh = generate(flags->node_count, flags->seed, flags->tangle);
    formats::move_cube_boundary(mesh, flags->motion);
    return formats::MeshFile(std::move(mesh));
  });
  command.add_option("--nodes", flags->node_count, "Number of nodes")->capture_default_str();
  command.add_option("--seed", flags->seed, "Seed of the random positions")->capture_default_str();
  command
      .add_option("--tangle", flags->tangle, "Share of the elements to invert, about, 0 to 0.45")
      ->capture_default_str();
  return command;
}

}  // namespace

void add_random_shapes(ShapeCommands& commands) {
  const auto add = [&](const char* shape, const char* description, Generator generate) {
    add_random(commands, shape, description, generate, std::make_shared<RandomFlags>());
  };
  const auto flags = std::make_shared<RandomFlags>();
  CLI::App& cube =
      add_random(commands, "cube", "Tetrahedra of random nodes in the unit cube, as in the paper",
                 formats::generate_cube, flags);
  CLI::Option* squeeze = cube.add_option("--squeeze", flags->motion.squeeze,
                                         "Factor of z for the boundary; the interior stays")
                             ->capture_default_str();
  CLI::Option* bend = cube.add_option("--bend", flags->motion.bend,
                                      "Angle by which the boundary bends, in degrees, 0 to 350; "
                                      "the interior stays")
                          ->capture_default_str()
                          ->excludes(squeeze);
  cube.add_option("--twist", flags->motion.twist,
                  "Angle by which the boundary twists about z, in degrees; the interior stays")
      ->capture_default_str()
      ->excludes(squeeze)
      ->excludes(bend);

  add("slope", "Tetrahedra of random nodes in a bank of earth", formats::generate_slope);
  add("mixed", "All volume elements in one mesh of the unit cube", formats::generate_mixed);
  add("square", "Triangles in the unit square", formats::generate_square);
  add("ball", "Tetrahedra of random nodes in the unit ball", formats::generate_ball);
  add("pipe", "Tetrahedra in a pipe, with curved sides", formats::generate_pipe);
}

}  // namespace meshsmooth::cli
