#include "job_queue.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "busy.hpp"

namespace meshsmooth::server {

QueuePlace::~QueuePlace() {
  if (queue_ != nullptr) queue_->give_back(caller_, bytes_);
}

void JobQueue::check_room(const std::string& caller, std::int64_t bytes) const {
  const std::lock_guard lock(mutex_);
  const std::int64_t too_many_bytes = bytes - (max_bytes_ - queued_bytes_);
  const auto found = places_.find(caller);
  const Places own = found == places_.end() ? Places() : found->second;
  // With this one; each has a share of the places, even when others have taken more before, up to
  // twice as many in all: callers are not always told apart by more than a connection.
  const auto callers = static_cast<int>(places_.size() + (found == places_.end() ? 1 : 0));
  const bool below_share = callers > 1 && queued_jobs_ / 2 < max_jobs_ &&
                           own.jobs < std::max(1, max_jobs_ / callers) &&
                           own.bytes + bytes <= max_bytes_ / callers;
  if (!below_share && (queued_jobs_ >= max_jobs_ || too_many_bytes > 0)) {
    const auto now = Clock::now();
    auto delay = jobs_left_.time_for(1, now);
    if (too_many_bytes > 0) {
      delay = std::max(delay, bytes_left_.time_for(static_cast<double>(too_many_bytes), now));
    }
    throw Busy("QUEUE_FULL",
               "the queue is full: " + std::to_string(queued_jobs_) + " jobs with " +
                   std::to_string(queued_bytes_) + " bytes wait; try again later",
               {{"queued_jobs", std::to_string(queued_jobs_)},
                {"queued_bytes", std::to_string(queued_bytes_)}},
               delay);
  }
}

QueuePlace JobQueue::take_place(const std::string& caller, std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  Places& own = places_[caller];
  ++own.jobs;
  own.bytes += bytes;
  ++queued_jobs_;
  queued_bytes_ += bytes;
  return {this, caller, bytes};
}

void JobQueue::push(std::shared_ptr<Job> job, QueueKey key) {
  {
    const std::lock_guard lock(mutex_);
    const Age age = next_age_++;
    ages_.emplace(job.get(), age);
    waiting_.emplace(age, Waiting{std::move(job), std::move(key), Clock::now()});
  }
  not_empty_.notify_all();  // a lane may belong to another device
}

template <class Visit>
void JobQueue::rank_all(const Visit& visit) const {
  const auto now = Clock::now();
  std::map<std::pair<std::string, int>, int> turns;  // by caller and level: jobs before
  for (const auto& [age, waiting] : waiting_) {
    const auto risen = ageing_.count() > 0 ? (now - waiting.since) / ageing_ : 0;
    const int level = static_cast<int>(std::min<std::int64_t>(
        static_cast<int>(waiting.key.priority) + risen, static_cast<int>(Priority::interactive)));
    const std::string& caller = waiting.key.caller;
    const auto running = running_.find(caller);
    const int turn = turns[{caller, level}]++ + (running == running_.end() ? 0 : running->second);
    visit(waiting, Rank{-level, turn, age});
  }
}

std::optional<JobQueue::Rank> JobQueue::find_next(int device, Takes takes) const {
  const bool newcomers = takes == Takes::newcomers;
  std::optional<Rank> next;
  const auto idle = idle_.find(device);
  if (newcomers && idle != idle_.end() && idle->second > 0) return next;
  rank_all([&](const Waiting& waiting, const Rank& rank) {
    if (waiting.key.device != device || (newcomers && running_.contains(waiting.key.caller)))
      return;
    if (!next || rank < *next) next = rank;
  });
  return next;
}

bool JobQueue::has_idle_lane(int device) const {
  const std::lock_guard lock(mutex_);
  const auto idle = idle_.find(device);
  return idle != idle_.end() && idle->second > 0;
}

std::shared_ptr<Job> JobQueue::pop(int device, Takes takes) {
  std::unique_lock lock(mutex_);
  std::optional<Rank> next;
  const int counted = takes == Takes::any ? 1 : 0;
  idle_[device] += counted;
  not_empty_.wait(lock, [&] {
    if (!closed_) next = find_next(device, takes);
    return closed_ || next.has_value();
  });
  idle_[device] -= counted;
  not_empty_.notify_all();  // a lane for newcomers may be the last idle one now
  if (closed_) return nullptr;
  auto first = waiting_.extract(next->age);
  std::shared_ptr<Job> job = std::move(first.mapped().job);
  ages_.erase(job.get());
  ++running_[first.mapped().key.caller];
  return job;
}

void JobQueue::done(const std::string& caller) {
  const std::lock_guard lock(mutex_);
  const auto running = running_.find(caller);
  if (--running->second > 0) return;
  running_.erase(running);
  not_empty_.notify_all();  // its next job may be for a lane of newcomers
}

bool JobQueue::remove(const Job& job) {
  std::shared_ptr<Job> removed;  // destroyed after the lock: this may be its last owner
  const std::lock_guard lock(mutex_);
  const auto found = ages_.find(&job);
  if (found == ages_.end()) return false;
  removed = std::move(waiting_.extract(found->second).mapped().job);
  ages_.erase(found);
  return true;
}

int JobQueue::position(const Job& job) const {
  const std::lock_guard lock(mutex_);
  const auto age = ages_.find(&job);
  if (age == ages_.end()) return 0;
  const int device = waiting_.at(age->second).key.device;
  std::vector<Rank> ranks;
  std::optional<Rank> own;
  rank_all([&](const Waiting& waiting, const Rank& rank) {
    if (waiting.key.device == device) ranks.push_back(rank);
    if (waiting.job.get() == &job) own = rank;
  });
  return 1 +
         static_cast<int>(std::ranges::count_if(ranks, [&](const Rank& r) { return r < *own; }));
}

void JobQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  not_empty_.notify_all();
}

void JobQueue::give_back(const std::string& caller, std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  const auto own = places_.find(caller);
  own->second.bytes -= bytes;
  if (--own->second.jobs == 0) places_.erase(own);
  --queued_jobs_;
  queued_bytes_ -= bytes;
  const auto now = Clock::now();
  jobs_left_.add(1, now);
  bytes_left_.add(static_cast<double>(bytes), now);
}

}  // namespace meshsmooth::server
