#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace meshsmooth {

/// Facts that belong to an error, e.g. {"element", "1042"}. They travel as the
/// metadata of google.rpc.ErrorInfo.
using ErrorDetails = std::vector<std::pair<std::string, std::string>>;

/// Base of everything core throws. `what()` says in one line what failed, where and with which
/// number; `reason()` is the stable name of the cause in UPPER_SNAKE_CASE (error_reason.hpp).
class Error : public std::runtime_error {
 public:
  Error(std::string reason, const std::string& message, ErrorDetails details = {})
      : std::runtime_error(message), reason_(std::move(reason)), details_(std::move(details)) {}

  [[nodiscard]] const std::string& reason() const noexcept { return reason_; }
  [[nodiscard]] const ErrorDetails& details() const noexcept { return details_; }

 private:
  std::string reason_;
  ErrorDetails details_;
};

/// The mesh itself is wrong: an index out of range, a facet used three times …
class InvalidMesh : public Error {
  using Error::Error;
};

/// An option is out of its range, or a combination is meaningless.
class InvalidOption : public Error {
  using Error::Error;
};

/// The option or backend is known by name but not available here.
class NotSupported : public Error {
  using Error::Error;
};

/// Host or device memory does not suffice.
class OutOfMemory : public Error {
  using Error::Error;
};

/// The device failed. When `fatal()`, its context cannot be used again.
class DeviceError : public Error {
 public:
  DeviceError(std::string reason, const std::string& message, bool fatal)
      : Error(std::move(reason), message), fatal_(fatal) {}
  [[nodiscard]] bool fatal() const noexcept { return fatal_; }

 private:
  bool fatal_;
};

/// The caller asked to stop and does not want a result.
class Cancelled : public Error {
  using Error::Error;
};

/// The job's deadline passed.
class DeadlineExceeded : public Error {
  using Error::Error;
};

}  // namespace meshsmooth
