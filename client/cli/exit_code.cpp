#include "exit_code.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {
namespace {

using client::ServiceError;
using client::StatusCode;

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Reasons that have their exit code wherever they were found: here or on the
/// server.
bool is_about_the_mesh(std::string_view reason) {
  static constexpr std::array<std::string_view, 12> kReasons = {
      "MESH_EMPTY",    "ARRAY_SIZE_MISMATCH",   "MIXED_DIMENSIONS", "INDEX_OUT_OF_RANGE",
      "REPEATED_NODE", "NON_FINITE_COORDINATE", "FACET_OVERUSED",   "ALL_ELEMENTS_INVERTED",
      "MESH_TANGLED",  "ELEMENT_NOT_SUPPORTED", "FORMAT_ERROR",     "FILE_TRUNCATED"};
  return contains(kReasons, reason);
}

bool is_about_availability(std::string_view reason) {
  static constexpr std::array<std::string_view, 2> kReasons = {"OPTION_NOT_SUPPORTED",
                                                               "BACKEND_NOT_AVAILABLE"};
  return contains(kReasons, reason);
}

bool is_about_usage(std::string_view reason) {
  static constexpr std::array<std::string_view, 5> kReasons = {
      "OPTION_OUT_OF_RANGE", "OPTION_MISPLACED", "FIXED_NODES_INVALID", "FORMAT_UNKNOWN",
      "CREDENTIALS_UNUSABLE"};
  return contains(kReasons, reason);
}

ExitCode exit_code_of_status(StatusCode code) {
  switch (code) {
    case StatusCode::cancelled:
    case StatusCode::deadline_exceeded:
      return ExitCode::stopped;
    case StatusCode::permission_denied:
    case StatusCode::unauthenticated:
    case StatusCode::resource_exhausted:
    case StatusCode::failed_precondition:
    case StatusCode::already_exists:
    case StatusCode::unimplemented:
    case StatusCode::unavailable:
      return ExitCode::refused;
    default:
      return ExitCode::failed;
  }
}

}  // namespace

ExitCode exit_code_of(const std::exception& error) {
  const auto* ours = dynamic_cast<const Error*>(&error);
  if (ours == nullptr) return ExitCode::failed;
  if (is_about_the_mesh(ours->reason())) return ExitCode::bad_mesh;
  if (is_about_availability(ours->reason())) return ExitCode::refused;
  if (is_about_usage(ours->reason())) return ExitCode::usage;
  if (const auto* service = dynamic_cast<const ServiceError*>(ours)) {
    return exit_code_of_status(service->code());
  }
  if (dynamic_cast<const InvalidMesh*>(ours) != nullptr) return ExitCode::bad_mesh;
  if (dynamic_cast<const InvalidOption*>(ours) != nullptr) return ExitCode::usage;
  if (dynamic_cast<const NotSupported*>(ours) != nullptr) return ExitCode::refused;
  if (dynamic_cast<const Cancelled*>(ours) != nullptr) return ExitCode::stopped;
  return ExitCode::failed;
}

std::string error_line(const std::exception& error) {
  std::string line = error.what();
  if (const auto* ours = dynamic_cast<const Error*>(&error); ours && !ours->reason().empty()) {
    line += " (" + ours->reason() + ")";
  }
  if (const auto* service = dynamic_cast<const ServiceError*>(&error);
      service && !service->hint().empty()) {
    line += "; " + service->hint();
  }
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

}  // namespace meshsmooth::cli
