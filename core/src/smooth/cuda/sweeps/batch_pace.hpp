#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace meshsmooth::detail {

/// How many sweeps a device does before the host looks at its caller again: as many as
/// take about 20 ms.
class BatchPace {
 public:
  /// What a sweep costs is not known yet: small meshes are done at one go.
  BatchPace(std::size_t node_count, int most)
      : limit_(most),
        next_(static_cast<int>(std::clamp<std::size_t>((std::size_t{1} << 23) / node_count, 1,
                                                       static_cast<std::size_t>(most)))) {}

  [[nodiscard]] int next(int sweeps_ahead) const { return std::min(next_, sweeps_ahead); }
  void start() { start_ = Clock::now(); }
  void stop(int sweeps_done) {
    constexpr double kAimSeconds = 0.02;
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    next_ = static_cast<int>(
        std::clamp(kAimSeconds / seconds * sweeps_done, 1.0, static_cast<double>(limit_)));
  }

 private:
  using Clock = std::chrono::steady_clock;
  int limit_;
  int next_;
  Clock::time_point start_;
};

}  // namespace meshsmooth::detail
