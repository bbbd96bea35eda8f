#pragma once

#include <signal.h>

#include <atomic>
#include <stop_token>
#include <thread>

namespace meshsmooth::cli {

/// Turns the first Ctrl-C (or SIGTERM) into a stop request and the second into
/// the end of the process. To be made before any other thread, since threads
/// inherit which signals they leave alone.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }
  /// Throws `Cancelled` once asked to stop.
  void check() const;

 private:
  void wait_for_signals();

  sigset_t signals_;
  sigset_t previous_;
  std::stop_source source_;
  std::atomic<bool> over_{false};
  std::jthread waiter_;
};

}  // namespace meshsmooth::cli
