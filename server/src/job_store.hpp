#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace meshsmooth::server {

class Job;

/// Limits for the unfinished jobs of one caller; 0: no limit.
struct Quota {
  int max_jobs = 0;
  std::int64_t max_bytes = 0;  // reserved for them, host and device memory together
};

/// All unfinished jobs and the most recent ended ones. The only place that decides who may access
/// a job: every lookup names the caller. Thread-safe.
class JobStore {
 public:
  explicit JobStore(std::size_t max_ended_jobs, Quota quota = {})
      : max_ended_jobs_(max_ended_jobs), quota_(quota) {}

  /// False, without effect, when another job of the same caller has its request id and can be
  /// joined. Throws OutOfMemory (QUOTA_EXCEEDED, or MESH_TOO_LARGE for a job that alone exceeds
  /// the quota) when the caller's unfinished jobs would exceed the quota. O(unfinished jobs).
  [[nodiscard]] bool add(const std::shared_ptr<Job>& job);
  /// Call when a job has ended. When there are too many ended jobs, the one with the most of them
  /// (see JobRequest::share_or_caller) loses its oldest, those without a result first. Returns the
  /// forgotten ones. O(log n + callers), and O(kept results) where they are many.
  std::vector<std::shared_ptr<Job>> retire(const Job& job);
  /// Forgets a job that has ended; false when it is unknown or unfinished.
  bool forget(const Job& job);

  /// A job of that caller; nothing when the caller has no such job.
  [[nodiscard]] std::shared_ptr<Job> find(const std::string& caller, const std::string& name) const;
  /// The newest job with this request id. O(log n).
  [[nodiscard]] std::shared_ptr<Job> find_request(const std::string& caller,
                                                  const std::string& request_id) const;

  /// Jobs of that caller older than `before` (a `Job::sequence`), newest first, at most
  /// `count` for which `wanted` returns true. O(n log n).
  [[nodiscard]] std::vector<std::shared_ptr<Job>> list(
      const std::string& caller, std::int64_t before, std::size_t count,
      const std::function<bool(const Job&)>& wanted) const;

  [[nodiscard]] std::vector<std::shared_ptr<Job>> living() const;

 private:
  using RequestKey = std::pair<std::string, std::string>;  // caller, request id
  void unlink(const std::shared_ptr<Job>& job);
  void check_quota(const Job& job) const;
  [[nodiscard]] std::shared_ptr<Job> take_surplus();
  void erase_ended(const std::shared_ptr<Job>& job);

  const std::size_t max_ended_jobs_;
  const Quota quota_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::shared_ptr<Job>> living_;  // by sequence
  std::map<std::int64_t, std::shared_ptr<Job>> ended_;
  std::map<std::string, std::set<std::int64_t>> ended_of_;  // by share; none is empty
  std::unordered_map<std::string, std::shared_ptr<Job>> by_name_;
  std::map<RequestKey, std::shared_ptr<Job>> by_request_;
};

}  // namespace meshsmooth::server
