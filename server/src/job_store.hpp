#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace meshsmooth::server {

class Job;

/// Every job that lives, and the newest of those that ended. Thread-safe.
class JobStore {
 public:
  explicit JobStore(std::size_t max_ended_jobs) : max_ended_jobs_(max_ended_jobs) {}

  /// False, and nothing is done, when another job of the same owner has its
  /// request id and can be joined. O(log n).
  [[nodiscard]] bool add(const std::shared_ptr<Job>& job);
  /// Call when a job has ended: the oldest ended ones are forgotten; returns them.
  std::vector<std::shared_ptr<Job>> retire(const Job& job);
  /// Forgets a job that has ended; false when it is not here, or lives.
  bool forget(const Job& job);

  /// Nothing when unknown.
  [[nodiscard]] std::shared_ptr<Job> find(const std::string& name) const;
  /// The newest job with this request id. O(log n).
  [[nodiscard]] std::shared_ptr<Job> find_request(const std::string& identity,
                                                  const std::string& request_id) const;

  /// Newest first, older than `before` (a `Job::sequence`), at most `count` for
  /// which `wanted` says so. O(n log n).
  [[nodiscard]] std::vector<std::shared_ptr<Job>> list(
      std::int64_t before, std::size_t count, const std::function<bool(const Job&)>& wanted) const;

  [[nodiscard]] std::vector<std::shared_ptr<Job>> living() const;

 private:
  using RequestKey = std::pair<std::string, std::string>;  // identity, request id
  void unlink(const std::shared_ptr<Job>& job);

  const std::size_t max_ended_jobs_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::shared_ptr<Job>> living_;  // by sequence
  std::map<std::int64_t, std::shared_ptr<Job>> ended_;
  std::unordered_map<std::string, std::shared_ptr<Job>> by_name_;
  std::map<RequestKey, std::shared_ptr<Job>> by_request_;
};

}  // namespace meshsmooth::server
