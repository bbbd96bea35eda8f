#pragma once

#include <chrono>
#include <optional>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {

/// That time from now, or the clock's last: "for ever" must not become the past.
template <class Clock>
[[nodiscard]] typename Clock::time_point time_after(std::chrono::nanoseconds wait) {
  const auto now = Clock::now();
  return wait < Clock::time_point::max() - now ? now + wait : Clock::time_point::max();
}

/// The attempts at one request: as many, and as long, as it allows.
class Retry {
 public:
  /// `request` has a timeout and outlives this.
  explicit Retry(const RequestOptions& request)
      : request_(request), deadline_(time_after<Clock>(*request.timeout)) {}

  [[nodiscard]] std::chrono::nanoseconds left() const { return deadline_ - Clock::now(); }

  /// Waits until it is time for the next attempt, longer each time. Throws the error when there
  /// is none: it is final, or time or attempts are used up. A requested stop ends the wait: the
  /// next attempt then says so.
  void wait(const ServiceError& error);

  /// Counts anew: the last attempt got further.
  void succeeded_in_part() { attempt_ = 0; }

 private:
  using Clock = std::chrono::steady_clock;

  const RequestOptions& request_;
  const Clock::time_point deadline_;
  int attempt_ = 0;
  std::optional<ServiceError> broken_;  // what cut off an attempt that had been under way
  std::optional<ServiceError> told_;    // the last one with a reason of the server's own
};

}  // namespace meshsmooth::client
