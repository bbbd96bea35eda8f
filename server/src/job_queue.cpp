#include "job_queue.hpp"

#include <iterator>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

QueuePlace::~QueuePlace() {
  if (queue_ != nullptr) queue_->give_back(bytes_);
}

QueuePlace JobQueue::admit(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (admitted_jobs_ >= max_jobs_ || bytes > max_bytes_ - admitted_bytes_) {
    throw OutOfMemory("QUEUE_FULL",
                      "the queue is full: " + std::to_string(admitted_jobs_) + " jobs with " +
                          std::to_string(admitted_bytes_) + " bytes wait; try again later",
                      {{"queued_jobs", std::to_string(admitted_jobs_)},
                       {"queued_bytes", std::to_string(admitted_bytes_)}});
  }
  ++admitted_jobs_;
  admitted_bytes_ += bytes;
  return {this, bytes};
}

void JobQueue::push(std::shared_ptr<Job> job, Priority priority) {
  {
    const std::lock_guard lock(mutex_);
    const Key key{-static_cast<int>(priority), next_age_++};
    keys_.emplace(job.get(), key);
    waiting_.emplace(key, std::move(job));
  }
  not_empty_.notify_one();
}

std::shared_ptr<Job> JobQueue::pop() {
  std::unique_lock lock(mutex_);
  not_empty_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
  if (closed_) return nullptr;
  auto first = waiting_.extract(waiting_.begin());
  keys_.erase(first.mapped().get());
  return std::move(first.mapped());
}

bool JobQueue::remove(const Job& job) {
  std::shared_ptr<Job> removed;  // its last owner may be this queue: destroyed after the lock
  const std::lock_guard lock(mutex_);
  const auto found = keys_.find(&job);
  if (found == keys_.end()) return false;
  removed = std::move(waiting_.extract(found->second).mapped());
  keys_.erase(found);
  return true;
}

int JobQueue::position(const Job& job) const {
  const std::lock_guard lock(mutex_);
  const auto found = keys_.find(&job);
  if (found == keys_.end()) return 0;
  return 1 + static_cast<int>(std::distance(waiting_.begin(), waiting_.find(found->second)));
}

void JobQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  not_empty_.notify_all();
}

void JobQueue::give_back(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  --admitted_jobs_;
  admitted_bytes_ -= bytes;
}

}  // namespace meshsmooth::server
