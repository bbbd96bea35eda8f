#include "exit_code.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "meshsmooth/client.hpp"
#include "report/encoding.hpp"

namespace meshsmooth::cli {
namespace {

using client::ServiceError;

/// The library names its own fields; the flag of a field differs in its dashes alone.
std::string with_flags(std::string text) {
  constexpr std::string_view kField = "Credentials::";
  for (std::size_t at = text.find(kField); at != std::string::npos; at = text.find(kField, at)) {
    text.replace(at, kField.size(), "--");
    for (at += 2; at < text.size() &&
                  (std::islower(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_');
         ++at) {
      if (text[at] == '_') text[at] = '-';
    }
  }
  return text;
}

}  // namespace

ExitCode exit_code_of(const std::exception& error) {
  const auto* ours = dynamic_cast<const Error*>(&error);
  if (ours == nullptr) return ExitCode::failed;
  if (const ErrorReason* reason = find_error_reason(ours->reason())) return reason->exit_code;
  if (const auto* service = dynamic_cast<const ServiceError*>(ours)) {
    return meshsmooth::exit_code_of(service->code());
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
    line += "; " + with_flags(service->hint());
  }
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

std::string error_json(const std::exception& error, ExitCode code) {
  const auto* ours = dynamic_cast<const Error*>(&error);
  const auto* service = dynamic_cast<const ServiceError*>(ours);
  const auto* parser = dynamic_cast<const CLI::ParseError*>(&error);
  std::string reason = ours != nullptr ? ours->reason() : std::string();
  if (parser != nullptr) reason = parse_error_reason(*parser);
  // A call that failed on its way has a status alone.
  if (reason.empty() && service != nullptr) reason = status_code_name(service->code());
  std::string details;
  if (ours != nullptr) {
    for (const auto& [key, value] : ours->details()) {
      details += (details.empty() ? "" : ", ") + json_string(key) + ": " + json_string(value);
    }
  }
  return "{\"error\": {\"reason\": " + json_string(reason) +
         ", \"message\": " + json_string(error.what()) + ", \"hint\": " +
         json_string(service != nullptr ? with_flags(service->hint()) : std::string()) +
         ", \"exit_code\": " + std::to_string(static_cast<int>(code)) + ", \"details\": {" +
         details + "}}}";
}

std::string parse_error_reason(const CLI::ParseError& error) {
  const bool value = dynamic_cast<const CLI::ValidationError*>(&error) != nullptr ||
                     dynamic_cast<const CLI::ConversionError*>(&error) != nullptr;
  return value ? "OPTION_OUT_OF_RANGE" : "OPTION_MISPLACED";
}

}  // namespace meshsmooth::cli
