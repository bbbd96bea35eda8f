#include "meshsmooth/error_reason.hpp"

#include <algorithm>
#include <iterator>

namespace meshsmooth {
namespace {

using std::chrono::milliseconds;
using enum ErrorOrigin;
using enum StatusCode;
using enum ExitCode;

/// What a code means where the reason does not decide.
struct Status {
  std::string_view name;
  ExitCode exit_code;
};

#include "error_reasons.inc"

static_assert(std::size(kStatuses) == static_cast<std::size_t>(unauthenticated) + 1);

}  // namespace

std::span<const ErrorReason> error_reasons() { return kReasons; }

const ErrorReason* find_error_reason(std::string_view name) {
  const auto* found = std::ranges::find(kReasons, name, &ErrorReason::name);
  return found == std::end(kReasons) ? nullptr : found;
}

std::string_view status_code_name(StatusCode code) {
  return kStatuses[static_cast<std::size_t>(code)].name;
}

ExitCode exit_code_of(StatusCode code) {
  const auto number = static_cast<std::size_t>(code);
  return number < std::size(kStatuses) ? kStatuses[number].exit_code : failed;
}

}  // namespace meshsmooth
