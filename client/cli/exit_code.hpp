#pragma once

#include <CLI/Error.hpp>
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

/// The same as a JSON object in one line, for programs: {"error": …} with the members reason,
/// message, hint, exit_code and details (of strings); what is not known is an empty string.
[[nodiscard]] std::string error_json(const std::exception& error, ExitCode code);

/// The reason that an error of the command line's parser has for programs.
[[nodiscard]] std::string parse_error_reason(const CLI::ParseError& error);

}  // namespace meshsmooth::cli
