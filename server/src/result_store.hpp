#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "job.hpp"

namespace meshsmooth::server {

/// Results that outlive their calls, each until its time has come; when they
/// are too many bytes the oldest goes. Who still sends one may finish.
/// Thread-safe.
class ResultStore {
 public:
  explicit ResultStore(std::int64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Needs a job that has succeeded and is kept; its time begins now.
  void keep(const std::shared_ptr<Job>& job);
  /// Nothing when it is not here.
  void drop(const Job& job);
  /// Drops those whose time has come.
  void expire(Clock::time_point now);

  [[nodiscard]] std::int64_t bytes() const;

 private:
  struct Entry {
    std::shared_ptr<Job> job;
    Clock::time_point until;
    std::int64_t bytes;
  };

  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, Entry> entries_;  // by the job's sequence: the oldest first
  std::int64_t bytes_ = 0;
};

}  // namespace meshsmooth::server
