#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "job.hpp"

namespace meshsmooth::server {

/// Results that outlive their calls, each until it expires; when they exceed the limit, the oldest
/// of whoever has the most bytes (see JobRequest::share_or_caller) is dropped first. A call that is
/// sending one can finish. Thread-safe.
class ResultStore {
 public:
  explicit ResultStore(std::int64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Needs a kept job that has succeeded; its time to live begins now.
  void keep(const std::shared_ptr<Job>& job);
  /// No effect when it is not here.
  void drop(const Job& job);
  /// Drops the expired results.
  void expire(Clock::time_point now);

  [[nodiscard]] std::int64_t bytes() const;

 private:
  struct Entry {
    std::shared_ptr<Job> job;
    Clock::time_point until;
    std::int64_t bytes;
  };

  using Entries = std::map<std::int64_t, Entry>;
  [[nodiscard]] Entries::iterator find_surplus();  // with the lock; O(n)

  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  Entries entries_;  // by the job's sequence: the oldest first
  std::int64_t bytes_ = 0;
};

}  // namespace meshsmooth::server
