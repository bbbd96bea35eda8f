#pragma once

#include <exception>
#include <string>

namespace meshsmooth::server {

/// An error as logs and metrics report it.
struct ErrorText {
  std::string reason;
  std::string message;
  bool ours = false;  // a meshsmooth::Error, not a bug
};

/// Empty without an error. The reason equals that of the call's status.
[[nodiscard]] ErrorText error_text(const std::exception_ptr& error);

}  // namespace meshsmooth::server
