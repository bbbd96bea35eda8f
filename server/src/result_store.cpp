#include "result_store.hpp"

#include <algorithm>
#include <string>
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
      const auto surplus = find_surplus();
      bytes_ -= surplus->second.bytes;
      dropped.push_back(std::move(surplus->second.job));
      entries_.erase(surplus);
    }
  }
  for (const auto& old : dropped) old->expire();
}

ResultStore::Entries::iterator ResultStore::find_surplus() {
  std::map<std::string, std::int64_t> bytes_of;
  const auto share = [](const auto& entry) -> const std::string& {
    return entry.second.job->request().share_or_caller();
  };
  for (const auto& entry : entries_) bytes_of[share(entry)] += entry.second.bytes;
  const auto most = std::ranges::max_element(bytes_of, {}, [](const auto& e) { return e.second; });
  return std::ranges::find_if(entries_, [&](const auto& e) { return share(e) == most->first; });
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
