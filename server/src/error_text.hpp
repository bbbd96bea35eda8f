#pragma once

#include <exception>
#include <string>

namespace meshsmooth::server {

/// What log lines and metrics say of an error.
struct ErrorText {
  std::string reason;
  std::string message;
  bool ours = false;  // a meshsmooth::Error, so no bug
};

/// Empty without an error. The reason is that of the call's status.
[[nodiscard]] ErrorText error_text(const std::exception_ptr& error);

}  // namespace meshsmooth::server
