#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "drain_rate.hpp"
#include "meshsmooth/enums.hpp"

namespace meshsmooth::server {

class Job;
class JobQueue;

/// What the queue has to know of a job.
struct QueueKey {
  std::string caller;  // whose share it uses
  int device = 0;
  Priority priority = Priority::normal;
};

/// A place in the queue, held from the end of the upload until the job runs or ends; released on
/// destruction. Move-only; the queue outlives it.
class QueuePlace {
 public:
  QueuePlace() = default;
  QueuePlace(QueuePlace&& other) noexcept
      : queue_(std::exchange(other.queue_, nullptr)),
        caller_(std::move(other.caller_)),
        bytes_(other.bytes_) {}
  QueuePlace& operator=(QueuePlace&& other) noexcept {
    std::swap(queue_, other.queue_);
    std::swap(caller_, other.caller_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~QueuePlace();

 private:
  friend class JobQueue;
  QueuePlace(JobQueue* queue, std::string caller, std::int64_t bytes)
      : queue_(queue), caller_(std::move(caller)), bytes_(bytes) {}

  JobQueue* queue_ = nullptr;
  std::string caller_;
  std::int64_t bytes_ = 0;
};

/// Orders waiting jobs: by priority, which rises by a level for every `ageing` waited; within a
/// level the callers take turns, those with fewer running jobs first; jobs of one caller by age.
/// Counts complete meshes only: when there are too many of them, new jobs are refused before they
/// upload anything, unless their caller has less than its share of the places; a job that was
/// uploaded always gets a place. Knows neither gRPC nor
/// backends nor what a job is. Thread-safe.
class JobQueue {
 public:
  using Clock = std::chrono::steady_clock;

  JobQueue(int max_jobs, std::int64_t max_bytes, Clock::duration ageing = std::chrono::minutes(1))
      : max_jobs_(max_jobs), max_bytes_(max_bytes), ageing_(ageing) {}

  /// Whether a job of so many mesh bytes may be uploaded now. Throws Busy (QUEUE_FULL).
  void check_room(const std::string& caller, std::int64_t bytes) const;
  /// For a job whose mesh is complete. Never fails: memory bounds how many upload at a time.
  [[nodiscard]] QueuePlace take_place(const std::string& caller, std::int64_t bytes);

  /// Never blocks, never fails. Needs a job that holds a place. O(log n).
  void push(std::shared_ptr<Job> job, QueueKey key);

  /// Which jobs a lane takes. `newcomers`: of callers without a running job, and only while no
  /// lane for any job waits.
  enum class Takes { any, newcomers };

  /// Waits for a job of this device, which then counts as running until `done`; nothing once
  /// the queue is closed. O(n log n).
  [[nodiscard]] std::shared_ptr<Job> pop(int device = 0, Takes takes = Takes::any);
  /// The caller has one job less running.
  void done(const std::string& caller);

  /// Whether a lane for any job of this device waits.
  [[nodiscard]] bool has_idle_lane(int device = 0) const;

  /// False when the job does not wait here. O(log n).
  bool remove(const Job& job);

  /// Position among the jobs of its device: 1 = next, 0 = not waiting here. O(n log n).
  [[nodiscard]] int position(const Job& job) const;

  /// Makes every `pop` return nothing; waiting jobs stay in the queue.
  void close();

 private:
  friend class QueuePlace;
  struct Waiting {
    std::shared_ptr<Job> job;
    QueueKey key;
    Clock::time_point since;
  };
  using Age = std::int64_t;
  struct Rank {  // the lowest is next
    int minus_level;
    int turn;  // of the caller, within the level
    Age age;
    friend auto operator<=>(const Rank&, const Rank&) = default;
  };

  struct Places {
    int jobs = 0;
    std::int64_t bytes = 0;
  };

  template <class Visit>
  void rank_all(const Visit& visit) const;
  [[nodiscard]] std::optional<Rank> find_next(int device, Takes takes) const;
  void give_back(const std::string& caller, std::int64_t bytes);

  const int max_jobs_;
  const std::int64_t max_bytes_;
  const Clock::duration ageing_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_;
  std::map<Age, Waiting> waiting_;
  std::unordered_map<const Job*, Age> ages_;
  std::map<std::string, int> running_;    // by caller
  std::map<std::string, Places> places_;  // by caller
  std::map<int, int> idle_;               // by device: lanes that wait for any job
  Age next_age_ = 0;
  int queued_jobs_ = 0;
  std::int64_t queued_bytes_ = 0;
  DrainRate jobs_left_, bytes_left_;
  bool closed_ = false;
};

}  // namespace meshsmooth::server
