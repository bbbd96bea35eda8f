#pragma once

#include <CLI/App.hpp>

#include "job_flags.hpp"

namespace meshsmooth::cli {

/// Adds a flag that sets a value, which must outlive the command.
template <class Value>
CLI::Option* add_flag(CLI::App& command, const Flag& flag, Value& value) {
  return command.add_option(flag.name, value, flag.help);
}

/// Adds one that takes no value.
inline CLI::Option* add_flag(CLI::App& command, const Flag& flag, bool& value) {
  return command.add_flag(flag.name, value, flag.help);
}

}  // namespace meshsmooth::cli
