#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace meshsmooth::server {

class Job;
class JobQueue;

/// Higher runs first.
enum class Priority { batch, normal, interactive };

/// A place in the queue, held from admission until the job runs or ends; given
/// back on destruction. Move-only; the queue outlives it.
class QueuePlace {
 public:
  QueuePlace() = default;
  QueuePlace(QueuePlace&& other) noexcept
      : queue_(std::exchange(other.queue_, nullptr)), bytes_(other.bytes_) {}
  QueuePlace& operator=(QueuePlace&& other) noexcept {
    std::swap(queue_, other.queue_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~QueuePlace();

 private:
  friend class JobQueue;
  QueuePlace(JobQueue* queue, std::int64_t bytes) : queue_(queue), bytes_(bytes) {}

  JobQueue* queue_ = nullptr;
  std::int64_t bytes_ = 0;
};

/// Orders waiting jobs by priority, then by age. Bounded by jobs and bytes at
/// admission, so a job that was uploaded always finds room. Knows neither gRPC
/// nor backends. Thread-safe.
class JobQueue {
 public:
  JobQueue(int max_jobs, std::int64_t max_bytes) : max_jobs_(max_jobs), max_bytes_(max_bytes) {}

  /// Throws OutOfMemory (QUEUE_FULL).
  [[nodiscard]] QueuePlace admit(std::int64_t bytes);

  /// Never blocks, never fails. Needs a job that holds a place. O(log n).
  void push(std::shared_ptr<Job> job, Priority priority);

  /// Waits for a job; nothing once the queue is closed.
  [[nodiscard]] std::shared_ptr<Job> pop();

  /// False when the job is not (or no longer) waiting here. O(log n).
  bool remove(const Job& job);

  /// 1 = next, 0 = not waiting here. O(n).
  [[nodiscard]] int position(const Job& job) const;

  /// Lets every `pop` return nothing; jobs that wait stay where they are.
  void close();

 private:
  friend class QueuePlace;
  using Key = std::pair<int, std::int64_t>;  // minus priority, age
  void give_back(std::int64_t bytes);

  const int max_jobs_;
  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_;
  std::map<Key, std::shared_ptr<Job>> waiting_;
  std::unordered_map<const Job*, Key> keys_;
  std::int64_t next_age_ = 0;
  int admitted_jobs_ = 0;
  std::int64_t admitted_bytes_ = 0;
  bool closed_ = false;
};

}  // namespace meshsmooth::server
