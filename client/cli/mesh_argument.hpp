#pragma once

#include <CLI/App.hpp>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::cli {

/// A mesh file on the command line: "-" is standard input or output.
struct MeshArgument {
  std::filesystem::path path;
  std::string format;           // ".inp", as --format names it; empty: the path tells
  bool self_contained = false;  // refused if it refers to other files
};

/// Adds the mesh file that a command reads, and --format.
void add_input_mesh(CLI::App& command, MeshArgument& input, const std::string& name,
                    const std::string& help);

/// Adds the option --output-format.
void add_output_format(CLI::App& command, std::string& format);

/// Where "-" may stand too: ", .gz", for the help of an option that names a mesh file.
[[nodiscard]] std::string input_help();
[[nodiscard]] std::string output_help(const std::string& extensions);

/// Another mesh file of the command that reads `input`: --format names its format too where its
/// name does not tell one, or the same that the input's name does.
[[nodiscard]] MeshArgument beside(const std::filesystem::path& path, const MeshArgument& input);

/// The output: its own format where one is named.
[[nodiscard]] MeshArgument output_beside(const MeshArgument& output, const MeshArgument& input);

/// The extension of the format that `input` is in, or its path where that is unknown.
[[nodiscard]] std::filesystem::path source_of(const MeshArgument& input);

[[nodiscard]] formats::MeshFile read_mesh(const MeshArgument& input);

/// Throws `InvalidOption` (OPTION_MISPLACED) where two arguments name standard input, which can be
/// read once.
void check_standard_input(const std::filesystem::path& a, const std::filesystem::path& b);

/// To be called before anything is printed, with the flags and values that name outputs. Where one
/// is standard output, all that would be printed there goes to the error output. Throws
/// `InvalidOption` (OPTION_MISPLACED) where two are.
void keep_standard_output(
    const std::vector<std::pair<std::string, std::filesystem::path>>& outputs);

}  // namespace meshsmooth::cli
