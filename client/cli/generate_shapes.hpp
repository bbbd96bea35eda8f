#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <string>

#include "commands.hpp"
#include "mesh_file.hpp"

namespace meshsmooth::cli {

/// The commands below `generate`, one for each shape, with the options of that shape.
class ShapeCommands {
 public:
  ShapeCommands(CLI::App& generate, Action& action) : generate_(generate), action_(action) {}

  /// Adds the command and its option for the output; `make` runs after parsing.
  CLI::App& add(const std::string& shape, const std::string& description,
                std::function<formats::MeshFile()> make);

 private:
  CLI::App& generate_;
  Action& action_;
};

/// Meshes with random nodes: cube, slope, mixed, square, ball, pipe.
void add_random_shapes(ShapeCommands& commands);
/// Meshes whose errors are built in (generate/cases.hpp): hub, bar, layer, damage, flap,
/// box-sphere.
void add_case_shapes(ShapeCommands& commands);

}  // namespace meshsmooth::cli
