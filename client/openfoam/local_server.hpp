#pragma once

#include <sys/types.h>

#include <string>

namespace meshsmooth_foam {

/// A meshsmooth-server that serves this process alone and ends with it, by `kill -9` too: its
/// standard input is a pipe from here. Its socket is in a private folder, which it removes.
class LocalServer {
 public:
  /// Returns when it serves.
  /// @param program a path, or a name to be looked for on PATH
  /// @throws std::runtime_error with the last lines of its log
  explicit LocalServer(const std::string& program);
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  /// unix:PATH
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  [[nodiscard]] std::string log() const;
  void end();

  std::string program_;
  std::string address_;
  pid_t process_ = -1;
  int input_ = -1;
  int log_ = -1;
};

}  // namespace meshsmooth_foam
