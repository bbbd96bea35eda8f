#pragma once

#include <string>

#include "command_tree.hpp"

namespace meshsmooth::cli {

/// Completion of a program for a shell, as a script that the shell sources: commands, options,
/// choices, files by their extensions and, by the hidden command `list-sets`, the node sets of the
/// mesh file on the command line.
[[nodiscard]] std::string bash_completion(const Command& program);
[[nodiscard]] std::string zsh_completion(const Command& program);
[[nodiscard]] std::string fish_completion(const Command& program);

/// "smart-laplacian taubin": the parts with a separator between.
[[nodiscard]] std::string joined(const std::vector<std::string>& parts,
                                 const std::string& separator);

/// `text` with each `from` replaced by `to`.
[[nodiscard]] std::string replaced(std::string text, const std::string& from,
                                   const std::string& to);

/// "_meshsmooth_server" of "meshsmooth-server": how its functions begin in a shell.
[[nodiscard]] std::string function_prefix(const Command& program);

/// "vtu|vtk" of the extensions of an argument.
[[nodiscard]] std::string extension_pattern(const Argument& argument);

}  // namespace meshsmooth::cli
