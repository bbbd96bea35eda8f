#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace meshsmooth::detail {

/// How many sweeps a device does before the host checks for cancellation: about 20 ms' worth.
class BatchPace {
 public:
  /// The time of a sweep is not known yet: small meshes are done in one batch.
  BatchPace(std::size_t node_count, int most)
      : limit_(most),
        next_(static_cast<int>(std::clamp<std::size_t>((std::size_t{1} << 23) / node_count, 1,
                                                       static_cast<std::size_t>(most)))) {}

  [[nodiscard]] int next(int sweeps_ahead) const { return std::min(next_, sweeps_ahead); }
  void start() { start_ = Clock::now(); }
  void stop(int sweeps_done) {
    constexpr double kTargetSeconds = 0.02;
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    next_ = static_cast<int>(
        std::clamp(kTargetSeconds / seconds * sweeps_done, 1.0, static_cast<double>(limit_)));
  }

 private:
  using Clock = std::chrono::steady_clock;
  int limit_;
  int next_;
  Clock::time_point start_;
};

/// The host's loop around a cooperative kernel that does several sweeps, at most `most`.
/// `launch(sweeps)` queues a batch; `settle()` waits for it, records its sweeps with `monitor`, and
/// returns whether they ended the iteration. `done` then holds the number of sweeps.
template <class Monitor, class Launch, class Settle>
void run_batches(std::size_t node_count, int most, Monitor& monitor, const int& done,
                 const Launch& launch, const Settle& settle) {
  BatchPace pace(node_count, most);
  for (bool ended = false; !ended;) {
    pace.start();
    launch(pace.next(monitor.sweeps_ahead()));
    ended = settle();
    pace.stop(done);
    ended = ended || monitor.interrupted();
  }
}

}  // namespace meshsmooth::detail
