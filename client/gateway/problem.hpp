#pragma once

#include <exception>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace meshsmooth::gateway {

/// Why a request is refused: problem details (RFC 9457) with a reason of docs/protocol.md.
class Problem : public std::exception {
 public:
  /// The status follows from the reason.
  Problem(std::string reason, std::string detail, std::map<std::string, std::string> details = {});
  /// Without a reason: an error of HTTP alone.
  Problem(int status, std::string detail);
  /// Of the line that the client writes with `--errors json`.
  explicit Problem(const nlohmann::json& error);

  [[nodiscard]] const char* what() const noexcept override { return detail_.c_str(); }
  [[nodiscard]] int status() const { return status_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// Seconds after which the same request may succeed; 0: it will not.
  [[nodiscard]] int retry_after() const { return retry_after_; }
  [[nodiscard]] nlohmann::json to_json() const;

 private:
  int status_;
  std::string reason_;
  std::string detail_;
  std::string hint_;
  std::map<std::string, std::string> details_;
  int retry_after_ = 0;
};

/// "Not Found".
[[nodiscard]] const char* status_title(int status);

}  // namespace meshsmooth::gateway
