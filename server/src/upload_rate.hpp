#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace meshsmooth::server {

/// When an upload counts as too slow: a leaky bucket. It may fall behind the minimum rate by
/// what that rate transfers in `window`, and bytes that arrive faster earn no more than that.
/// Thus a client that stops is noticed after `window`, one that trickles soon after, and one
/// above the rate never, as long as `window` suffices for a message. Not thread-safe.
class UploadRate {
 public:
  using Clock = std::chrono::steady_clock;

  /// `bytes_per_second` 0: there is no minimum.
  UploadRate(std::int64_t bytes_per_second, Clock::duration window)
      : bytes_per_second_(static_cast<double>(bytes_per_second)), window_(window) {}

  /// The minimum is at least so much. Call it before `start`.
  void require(double bytes_per_second) {
    bytes_per_second_ = std::max(bytes_per_second_, bytes_per_second);
  }
  [[nodiscard]] std::int64_t bytes_per_second() const {
    return static_cast<std::int64_t>(bytes_per_second_);
  }

  /// The upload begins.
  void start(Clock::time_point now) {
    if (bytes_per_second_ > 0) deadline_ = now + window_;
  }
  /// So many bytes have arrived.
  void add(std::int64_t bytes, Clock::time_point now) {
    if (!deadline_) return;
    // Bounded before it becomes a duration, which could overflow.
    const double earned = std::min(static_cast<double>(bytes) / bytes_per_second_, kMaxSeconds);
    deadline_ = std::min(now + window_, *deadline_ + std::chrono::duration_cast<Clock::duration>(
                                                         std::chrono::duration<double>(earned)));
  }

  /// When the upload is too slow unless more bytes arrive; nothing before `start` and without
  /// a minimum.
  [[nodiscard]] std::optional<Clock::time_point> deadline() const { return deadline_; }
  /// The same if it may fall behind by `window` only.
  [[nodiscard]] std::optional<Clock::time_point> deadline(Clock::duration window) const {
    if (!deadline_) return std::nullopt;
    return *deadline_ - window_ + std::min(window, window_);
  }

 private:
  static constexpr double kMaxSeconds = 1e8;

  double bytes_per_second_;
  const Clock::duration window_;
  std::optional<Clock::time_point> deadline_;
};

}  // namespace meshsmooth::server
