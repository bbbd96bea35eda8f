#pragma once

#include <exception>
#include <string>

#include "meshsmooth/error_reason.hpp"

namespace meshsmooth::cli {

using meshsmooth::ExitCode;

/// The exit code that an error ends the program with: its reason's, else that of its status or
/// type.
[[nodiscard]] ExitCode exit_code_of(const std::exception& error);

/// The error in one line: what and where, the reason's name, what to do.
[[nodiscard]] std::string error_line(const std::exception& error);

}  // namespace meshsmooth::cli
