#include <CLI/CLI.hpp>
#include <charconv>
#include <map>
#include <memory>

#include "generate/cases.hpp"
#include "generate_shapes.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

using formats::LayerElements;

const std::map<std::string, LayerElements> kLayerElements = {
    {"hex", LayerElements::hexahedra},
    {"wedge", LayerElements::wedges},
    {"tet", LayerElements::tetrahedra},
    {"quad", LayerElements::quads},
    {"triangle", LayerElements::triangles}};

/// A command for `generate`, and the options that its flags fill.
template <class Options>
std::pair<CLI::App&, std::shared_ptr<Options>> add_case(
    ShapeCommands& commands, const std::string& shape, const std::string& description,
    formats::MeshFile (*generate)(const Options&)) {
  auto options = std::make_shared<Options>();
  CLI::App& command =
      commands.add(shape, description, [generate, options] { return generate(*options); });
  return {command, std::move(options)};
}

/// "12x12x20", or "12x20" in the plane; the last is across the layer.
std::array<int, 3> parse_cells(const std::string& text, bool plane) {
  std::array<int, 3> cells = {1, 1, 1};
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  const std::size_t count = plane ? 2 : 3;
  for (std::size_t n = 0; n < count; ++n) {
    const auto [next, error] = std::from_chars(at, end, cells[plane && n == 1 ? 2 : n]);
    const bool last = n + 1 == count;
    if (error != std::errc() || (last ? next != end : next == end || *next != 'x')) {
      throw InvalidOption("OPTION_OUT_OF_RANGE",
                          "cells " + text + ": expected " + (plane ? "two" : "three") +
                              " numbers, as in " + (plane ? "12x20" : "12x12x20"),
                          {{"field", "cells"}});
    }
    at = next + 1;
  }
  return cells;
}

struct LayerFlags {
  formats::LayerOptions options;
  std::string elements = "hex";
  std::string cells;
};

formats::MeshFile generate_layer(const LayerFlags& flags) {
  formats::LayerOptions options = flags.options;
  options.elements = kLayerElements.at(flags.elements);
  const bool plane =
      options.elements == LayerElements::quads || options.elements == LayerElements::triangles;
  if (!flags.cells.empty()) options.cells = parse_cells(flags.cells, plane);
  return formats::generate_layer(options);
}

void add_layer(ShapeCommands& commands) {
  const auto [command, flags] =
      add_case(commands, "layer", "A boundary layer on a wall of length 1", generate_layer);
  command.add_option("--elements", flags->elements, "Elements; quad and triangle are in the plane")
      ->check(CLI::IsMember({"hex", "wedge", "tet", "quad", "triangle"}))
      ->type_name("TYPE")
      ->capture_default_str();
  command.add_option("--cells", flags->cells,
                     "Cells along the wall and, last, across the layer [12x12x20, in the plane "
                     "12x20]");
  command.add_option("--first", flags->options.first, "Height of the first layer")
      ->capture_default_str();
  command
      .add_option("--growth", flags->options.growth,
                  "Ratio of the height of a layer to that of the one below")
      ->capture_default_str();
  command
      .add_option("--jitter", flags->options.jitter,
                  "Largest move of the interior nodes of the layers, in each direction, as a share "
                  "of the height of their layer")
      ->capture_default_str();
  command
      .add_option("--core", flags->options.core, "Layers on top of cells as high as they are long")
      ->capture_default_str();
  command
      .add_option("--tangle", flags->options.tangle,
                  "Share of the core's elements to invert, about, 0 to 0.45")
      ->capture_default_str();
  command.add_option("--seed", flags->options.seed, "Seed of jitter and tangle")
      ->capture_default_str();
}

void add_hub(ShapeCommands& commands) {
  const auto [command, options] =
      add_case(commands, "hub", "An annulus whose inner circle is rotated", formats::generate_hub);
  command
      .add_option("--rows", options->rows, "Rows of elements from the inner to the outer circle")
      ->capture_default_str();
  command
      .add_option("--degrees", options->degrees,
                  "Rotation of the inner circle, in degrees; the interior stays")
      ->capture_default_str();
  command
      .add_option("--layers", options->layers,
                  "Layers of tetrahedra along the axis; 0: triangles in the plane")
      ->capture_default_str();
}

void add_bar(ShapeCommands& commands) {
  const auto [command, options] = add_case(
      commands, "bar", "A bar of tetrahedra, 1 x 1 x 4, with a rotated end", formats::generate_bar);
  command.add_option("--cells", options->cells, "Cells along an edge of length 1")
      ->capture_default_str();
  command
      .add_option("--degrees", options->degrees,
                  "Rotation of one end, in degrees; the interior stays")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--sides",
          [options = options](const std::string& word) { options->sides_given = word == "given"; },
          "free: only the ends are fixed and rotated | given: so are the sides, in proportion "
          "[free]")
      ->check(CLI::IsMember({"free", "given"}))
      ->type_name("SIDES");
}

void add_damage(ShapeCommands& commands) {
  const auto [command, options] =
      add_case(commands, "damage", "A cube of tetrahedra with a few nodes next to a neighbour",
               formats::generate_damage);
  command.add_option("--cells", options->cells, "Cells along an edge of the cube")
      ->capture_default_str();
  command.add_option("--count", options->count, "Number of damaged nodes")->capture_default_str();
}

void add_flap(ShapeCommands& commands) {
  const auto [command, options] =
      add_case(commands, "flap", "Turek and Hron's channel with a flap, triangles (Gmsh)",
               formats::generate_flap);
  command.add_option("--size", options->size, "Element size at the flap; five times at the walls")
      ->capture_default_str();
  CLI::Option* tip = command
                         .add_option("--tip", options->tip,
                                     "Rise of the tip as a share of the free height, -0.95 to "
                                     "0.95; the interior stays")
                         ->capture_default_str();
  command.add_option("--degrees", options->degrees, "Turn of the tip in degrees, instead of --tip")
      ->capture_default_str()
      ->excludes(tip);
}

void add_box_sphere(ShapeCommands& commands) {
  const auto [command, options] =
      add_case(commands, "box-sphere", "A cube with a spherical hole, tetrahedra (Gmsh)",
               formats::generate_box_sphere);
  command.add_option("--size", options->size, "Element size")->capture_default_str();
  command.add_option("--radius", options->radius, "Radius of the hole")->capture_default_str();
  command
      .add_option("--move", options->move,
                  "Move of the hole along x as a share of its gap to the wall, -0.95 to 0.95; the "
                  "interior stays")
      ->capture_default_str();
}

}  // namespace

void add_case_shapes(ShapeCommands& commands) {
  add_hub(commands);
  add_bar(commands);
  add_layer(commands);
  add_damage(commands);
  add_flap(commands);
  add_box_sphere(commands);
}

}  // namespace meshsmooth::cli
