#pragma once

#include <string>

#include "commands.hpp"

namespace meshsmooth::cli {

/// `completion` and, hidden, `write-manual` and `list-sets`: they describe `app` as it is when they
/// run, with the commands that are added later.
void add_manual_commands(CLI::App& app, Action& action, const std::string& version);

}  // namespace meshsmooth::cli
