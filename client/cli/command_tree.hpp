#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace meshsmooth::cli {

/// What the value of an option is, as far as a shell can complete it.
enum class ValueKind {
  none,      // a switch: no value
  text,      // anything
  number,    // anything numeric
  choice,    // one of `Argument::choices`
  file,      // any file
  mesh,      // a file with one of `Argument::extensions`
  node_set,  // a set of nodes of the mesh file on the command line
};

/// An option or a positional argument.
struct Argument {
  std::vector<std::string> names;  // "-o", "--output"; of a positional argument its one name
  std::string help;
  std::string default_text;  // empty: none, or in the help
  std::string range;         // "0 - 1", or empty
  std::string group;         // "Options", "Security"
  ValueKind kind = ValueKind::none;
  std::vector<std::string> choices;
  std::vector<std::string> extensions;  // ".vtu"
  bool required = false;
  bool list = false;  // values are separated by commas
};

/// A command with all that the command line parser knows of it; hidden ones are left out.
struct Command {
  std::string path;  // "meshsmooth generate hub"
  std::string name;  // "hub"
  std::string description;
  std::vector<Argument> positionals;
  std::vector<Argument> options;
  std::vector<Command> commands;
};

/// Describes the program `app`, called `name`, and all commands below it. Kinds of values follow
/// from the validators and the help: a help that begins with "mesh file" or with a list of
/// extensions means a mesh, one that begins with "file", "output file" and the like a file, a name
/// that ends in "-set" a set of nodes.
[[nodiscard]] Command describe_program(const CLI::App& app, const std::string& name);

/// "MESH", "FILE", "NUMBER": what stands for the value in a synopsis; empty for a switch.
[[nodiscard]] std::string placeholder(const Argument& argument);

/// The help up to its first full stop, semicolon or default in brackets, for lists in a shell.
[[nodiscard]] std::string brief_help(const std::string& help);

}  // namespace meshsmooth::cli
