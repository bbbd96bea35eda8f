#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string_view>

/// What an error's reason means to a caller. `proto/declaration/reasons.toml` declares it: the
/// server's status, retries, exit codes, Python's exceptions and docs/protocol.md come from there.
namespace meshsmooth {

/// The status of a failed call. The numbers are those of gRPC.
enum class StatusCode {
  cancelled = 1,
  unknown = 2,
  invalid_argument = 3,
  deadline_exceeded = 4,
  not_found = 5,
  already_exists = 6,
  permission_denied = 7,
  resource_exhausted = 8,
  failed_precondition = 9,
  out_of_range = 11,
  unimplemented = 12,
  internal = 13,
  unavailable = 14,
  data_loss = 15,
  unauthenticated = 16,
};

/// The exit code of a program.
enum class ExitCode {
  done = 0,
  failed = 1,
  usage = 2,
  bad_mesh = 3,
  refused = 4,
  stopped = 5,
  incomplete = 6,  // a result that is short of what was asked for
};

/// Where errors with a reason come from.
enum class ErrorOrigin {
  server,  // travels as google.rpc.ErrorInfo; a library that checks before it sends has it too
  client,  // never travels: files, command lines, answers
};

/// A row of the table.
struct ErrorReason {
  std::string_view name;  // UPPER_SNAKE_CASE, stable
  ErrorOrigin origin;
  StatusCode status;  // of the call
  ExitCode exit_code;
  std::string_view metadata;      // keys of the details, separated by ", "
  std::string_view meaning;       // one line
  std::string_view retry = "no";  // "yes, after the delay" …
  /// RetryInfo of errors that carry no delay of their own; unset: none.
  std::optional<std::chrono::milliseconds> retry_delay = {};
};

/// All reasons, by origin and status.
[[nodiscard]] std::span<const ErrorReason> error_reasons();

/// Null when no reason has this name. O(number of reasons).
[[nodiscard]] const ErrorReason* find_error_reason(std::string_view name);

/// "INVALID_ARGUMENT".
[[nodiscard]] std::string_view status_code_name(StatusCode code);

/// The exit code of a failed call without a known reason; `failed` for unknown codes.
[[nodiscard]] ExitCode exit_code_of(StatusCode code);

}  // namespace meshsmooth
