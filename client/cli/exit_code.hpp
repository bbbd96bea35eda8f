#pragma once

#include <exception>
#include <string>

namespace meshsmooth::cli {

/// What the shell is told.
enum class ExitCode { done = 0, failed = 1, usage = 2, bad_mesh = 3, refused = 4, stopped = 5 };

/// The exit code an error ends the program with.
[[nodiscard]] ExitCode exit_code_of(const std::exception& error);

/// The error in one line: what and where, the reason's name, what to do.
[[nodiscard]] std::string error_line(const std::exception& error);

}  // namespace meshsmooth::cli
