#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>

namespace meshsmooth::server {

/// How fast something goes away: what went in the last half minute counts most.
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

  /// How long until `amount` has gone, at this rate; between 50 ms and 30 s, and
  /// 1 s as long as nothing has gone.
  [[nodiscard]] std::chrono::nanoseconds time_for(double amount, Clock::time_point now) const {
    constexpr double kShortest = 0.05, kLongest = 30, kUnknown = 1;
    double seconds = kUnknown;
    if (begun_ && sum_ > 0) {
      // What was seen of the window: less of it at the start.
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
