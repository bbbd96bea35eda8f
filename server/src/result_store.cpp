#include "result_store.hpp"

#include <utility>
#include <vector>

namespace meshsmooth::server {

void ResultStore::keep(const std::shared_ptr<Job>& job) {
  std::vector<std::shared_ptr<Job>> dropped;
  {
    const std::lock_guard lock(mutex_);
    const std::int64_t bytes = job->request().result_bytes();
    entries_.emplace(job->sequence(), Entry{job, Clock::now() + *job->request().result_ttl, bytes});
    bytes_ += bytes;
    while (bytes_ > max_bytes_) {
      bytes_ -= entries_.begin()->second.bytes;
      dropped.push_back(std::move(entries_.begin()->second.job));
      entries_.erase(entries_.begin());
    }
  }
  for (const auto& old : dropped) old->expire();
}

void ResultStore::drop(const Job& job) {
  std::shared_ptr<Job> dropped;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(job.sequence());
    if (found == entries_.end()) return;
    bytes_ -= found->second.bytes;
    dropped = std::move(found->second.job);
    entries_.erase(found);
  }
  dropped->expire();
}

void ResultStore::expire(Clock::time_point now) {
  std::vector<std::shared_ptr<Job>> dropped;
  {
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      if (entry->second.until > now) {
        ++entry;
        continue;
      }
      bytes_ -= entry->second.bytes;
      dropped.push_back(std::move(entry->second.job));
      entry = entries_.erase(entry);
    }
  }
  for (const auto& job : dropped) job->expire();
}

std::int64_t ResultStore::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace meshsmooth::server
