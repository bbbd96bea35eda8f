#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <utility>

namespace meshsmooth::server {

/// Whether a server answers new connections: a listener that has stopped accepting still completes
/// TCP's handshake, so a first byte of the protocol must come back. Opens one connection. Blocks
/// for at most `timeout`, and while a host name is resolved.
///
/// @param listen   HOST:PORT or unix:PATH, as in the settings
/// @param port     the bound port, which replaces that of `listen`
/// @param tls      whether it speaks TLS
[[nodiscard]] bool port_answers(const std::string& listen, int port, bool tls,
                                std::chrono::milliseconds timeout);

/// Probes a port, and says that it is dead once two probes in a row have failed: one may fail where
/// the machine is busy, upon which a proxy would send nobody here for seconds. Thread-safe.
class PortWatch {
 public:
  explicit PortWatch(std::function<bool()> answers) : answers_(std::move(answers)) {}

  [[nodiscard]] bool is_dead() {
    if (answers_()) {
      failed_ = 0;
      return false;
    }
    return ++failed_ >= 2;
  }

 private:
  const std::function<bool()> answers_;
  std::atomic<int> failed_ = 0;
};

}  // namespace meshsmooth::server
