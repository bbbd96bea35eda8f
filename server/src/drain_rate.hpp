#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>

namespace meshsmooth::server {

/// The rate at which something is freed: an exponentially weighted average over half a minute.
/// Not thread-safe.
class DrainRate {
 public:
  using Clock = std::chrono::steady_clock;

  void add(double amount, Clock::time_point now) {
    if (!begun_) {
      begun_ = true;
      first_ = last_ = now;
    }
    sum_ = sum_ * decay(now) + amount;
    last_ = now;
  }

  /// How long it takes to free `amount` at this rate, clamped to 50 ms to 30 s; 1 s as long as
  /// nothing has been freed.
  [[nodiscard]] std::chrono::nanoseconds time_for(double amount, Clock::time_point now) const {
    constexpr double kShortest = 0.05, kLongest = 30, kUnknown = 1;
    double seconds = kUnknown;
    if (begun_ && sum_ > 0) {
      // The observed part of the window, which is short at the start.
      const double age = std::max(std::chrono::duration<double>(now - first_).count(), kShortest);
      const double window = kWindow * (1 - std::exp(-age / kWindow));
      seconds = amount * window / (sum_ * decay(now));
    }
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(std::clamp(seconds, kShortest, kLongest)));
  }

 private:
  static constexpr double kWindow = 30;  // seconds

  [[nodiscard]] double decay(Clock::time_point now) const {
    return std::exp(-std::chrono::duration<double>(now - last_).count() / kWindow);
  }

  bool begun_ = false;
  double sum_ = 0;
  Clock::time_point first_, last_;
};

}  // namespace meshsmooth::server
