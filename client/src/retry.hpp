#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {

/// Waits until it is time for the next attempt, each twice as long after the second as
/// after the one before. False when there is none: the error is final, or time or attempts
/// are used up. A requested stop ends the wait: the next attempt then says so.
inline bool wait_to_retry(const ServiceError& error, int attempt, const RequestOptions& request,
                          std::chrono::steady_clock::time_point deadline) {
  using namespace std::chrono_literals;
  if (!error.retry_delay() || attempt >= request.max_attempts) return false;
  const std::chrono::nanoseconds backoff = attempt == 1 ? 0ms : 50ms * (1 << std::min(attempt, 8));
  const auto until = std::chrono::steady_clock::now() + std::max(*error.retry_delay(), backoff);
  if (until >= deadline) return false;
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  stopped.wait_until(lock, request.stop, until, [] { return false; });
  return true;
}

}  // namespace meshsmooth::client
