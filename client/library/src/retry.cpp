#include "retry.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace meshsmooth::client {

void Retry::wait(const ServiceError& error) {
  using namespace std::chrono_literals;
  ++attempt_;
  std::optional<std::chrono::nanoseconds> delay = error.retry_delay();
  // A server that was there may come back, at an address where nobody answers now.
  const bool gone = broken_ && !delay && error.code() == StatusCode::unavailable;
  if (gone) delay = 0ms;
  if (delay && error.reason().empty() && !gone) broken_ = error;
  if (!error.reason().empty()) told_ = error;
  const auto backoff = attempt_ == 1 ? 0ms : 50ms * (1 << std::min(attempt_, 8));
  const auto until =
      Clock::now() + std::max<std::chrono::nanoseconds>(delay.value_or(0ns), backoff);
  if (!delay || attempt_ >= request_.max_attempts || until >= deadline_) {
    // What happened to the job says more than that nobody answers now.
    const bool ended_here =
        request_.stop.stop_requested() || error.code() == StatusCode::deadline_exceeded;
    if (error.reason().empty() && told_ && !ended_here) throw *told_;
    throw gone ? *broken_ : error;
  }
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  stopped.wait_until(lock, request_.stop, until, [] { return false; });
}

}  // namespace meshsmooth::client
