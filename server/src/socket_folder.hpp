#pragma once

#include <atomic>
#include <string>

namespace meshsmooth::server {

/// A Unix socket for a setting that is "unix:", without a path: in a folder of its own that only
/// the owner can enter (mode 0700).
class SocketFolder {
 public:
  /// Creates the folder in $TMPDIR or, where the path would be too long for a socket, in /tmp.
  /// Throws InvalidOption (OPTION_OUT_OF_RANGE).
  explicit SocketFolder(const std::string& setting);
  ~SocketFolder() { remove(); }
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;

  /// What to serve on: unix:PATH.
  [[nodiscard]] std::string address() const { return "unix:" + socket_; }
  /// A second one in the same folder: whoever removes the first finds both.
  [[nodiscard]] std::string second_address() const { return "unix:" + second_socket_; }

  /// Removes sockets and folder, once. Thread-safe.
  void remove() noexcept;

 private:
  std::string folder_;
  std::string socket_;
  std::string second_socket_;
  std::atomic<bool> removed_ = false;
};

}  // namespace meshsmooth::server
