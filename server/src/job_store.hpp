#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace meshsmooth::server {

class Job;

/// Every job that lives, and the newest of those that ended. Thread-safe.
class JobStore {
 public:
  explicit JobStore(std::size_t max_ended_jobs) : max_ended_jobs_(max_ended_jobs) {}

  void add(std::shared_ptr<Job> job);
  /// Call when a job has ended: the oldest ended ones are forgotten.
  void retire(const Job& job);

  /// Nothing when unknown. O(n).
  [[nodiscard]] std::shared_ptr<Job> find(const std::string& name) const;

  /// Newest first, older than `before` (a `Job::sequence`), at most `count` for
  /// which `wanted` says so. O(n log n).
  [[nodiscard]] std::vector<std::shared_ptr<Job>> list(
      std::int64_t before, std::size_t count, const std::function<bool(const Job&)>& wanted) const;

  [[nodiscard]] std::vector<std::shared_ptr<Job>> living() const;

 private:
  const std::size_t max_ended_jobs_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::shared_ptr<Job>> living_;  // by sequence
  std::map<std::int64_t, std::shared_ptr<Job>> ended_;
};

}  // namespace meshsmooth::server
