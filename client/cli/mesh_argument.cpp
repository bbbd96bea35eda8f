#include "mesh_argument.hpp"

#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <iostream>
#include <optional>

#include "file_bytes.hpp"
#include "self_contained.hpp"

namespace meshsmooth::cli {
namespace {

/// Takes a name with or without the dot in any letter case, and makes it ".inp".
CLI::Validator format_names(const std::string& extensions) {
  std::string names = extensions;
  std::ranges::replace(names, ' ', ',');
  std::erase(names, '.');
  const auto check = [extensions](std::string& name) {
    std::string found = formats::find_format_name({}, name);
    if (found.empty()) return name + " is not one of " + extensions;
    name = std::move(found);
    return std::string();
  };
  return {check, "{" + names + "}"};
}

}  // namespace

std::string input_help() {
  return "Mesh file: " + formats::readable_extensions() + ", also with .gz; - is standard input";
}

std::string output_help(const std::string& extensions) {
  return extensions + ", also with .gz; - is standard output";
}

void add_input_mesh(CLI::App& command, MeshArgument& input, const std::string& name,
                    const std::string& help) {
  command.add_option(name, input.path, help)->required();
  command
      .add_option("--format", input.format,
                  "Format of " + name +
                      ", and of other mesh files whose names do not tell theirs [by extension]")
      ->check(format_names(formats::readable_extensions()));
  command.add_flag("--self-contained", input.self_contained,
                   "Refusal of mesh files that refer to other files, for files of strangers");
}

void add_output_format(CLI::App& command, std::string& format) {
  command
      .add_option("--output-format", format,
                  "Format of the output [by extension; where that tells none, the input's]")
      ->check(format_names(formats::writable_extensions()));
}

MeshArgument beside(const std::filesystem::path& path, const MeshArgument& input) {
  const std::string own = formats::find_format_name(path);
  const bool same = own.empty() || own == formats::find_format_name(input.path);
  return {path, same ? input.format : std::string(), input.self_contained};
}

MeshArgument output_beside(const MeshArgument& output, const MeshArgument& input) {
  return output.format.empty() ? beside(output.path, input) : output;
}

std::filesystem::path source_of(const MeshArgument& input) {
  const std::string format = formats::find_format_name(input.path, input.format);
  return format.empty() ? input.path : std::filesystem::path(format);
}

formats::MeshFile read_mesh(const MeshArgument& input) {
  std::optional<formats::SelfContainedReading> scope;
  if (input.self_contained) scope.emplace(input.path);
  return formats::read_mesh_file(input.path, input.format);
}

void check_standard_input(const std::filesystem::path& a, const std::filesystem::path& b) {
  if (!formats::is_standard_input(a) || !formats::is_standard_input(b)) return;
  throw InvalidOption("OPTION_MISPLACED", "two arguments name standard input, which is read once");
}

void keep_standard_output(
    const std::vector<std::pair<std::string, std::filesystem::path>>& outputs) {
  std::string taken;
  for (const auto& [flag, path] : outputs) {
    if (!formats::is_standard_output(path)) continue;
    if (!taken.empty()) {
      throw InvalidOption("OPTION_MISPLACED", taken + " and " + flag + " both name standard output",
                          {{"field", flag}});
    }
    taken = flag;
    std::cout.rdbuf(std::cerr.rdbuf());
  }
}

}  // namespace meshsmooth::cli
