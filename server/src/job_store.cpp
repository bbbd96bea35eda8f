#include "job_store.hpp"

#include <algorithm>
#include <utility>

#include "job.hpp"

namespace meshsmooth::server {

void JobStore::add(std::shared_ptr<Job> job) {
  const std::lock_guard lock(mutex_);
  const std::int64_t sequence = job->sequence();
  living_.emplace(sequence, std::move(job));
}

void JobStore::retire(const Job& job) {
  const std::lock_guard lock(mutex_);
  ended_.insert(living_.extract(job.sequence()));
  if (ended_.size() > max_ended_jobs_) ended_.erase(ended_.begin());
}

std::shared_ptr<Job> JobStore::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  for (const auto* jobs : {&living_, &ended_}) {
    for (const auto& [sequence, job] : *jobs) {
      if (job->name() == name) return job;
    }
  }
  return nullptr;
}

std::vector<std::shared_ptr<Job>> JobStore::list(
    std::int64_t before, std::size_t count, const std::function<bool(const Job&)>& wanted) const {
  std::vector<std::shared_ptr<Job>> jobs;
  {
    const std::lock_guard lock(mutex_);
    for (const auto* part : {&living_, &ended_}) {
      for (const auto& [sequence, job] : *part) {
        if (sequence < before) jobs.push_back(job);
      }
    }
  }
  std::sort(jobs.begin(), jobs.end(),
            [](const auto& a, const auto& b) { return a->sequence() > b->sequence(); });
  std::erase_if(jobs, [&](const auto& job) { return !wanted(*job); });
  if (jobs.size() > count) jobs.resize(count);
  return jobs;
}

std::vector<std::shared_ptr<Job>> JobStore::living() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Job>> jobs;
  for (const auto& [sequence, job] : living_) jobs.push_back(job);
  return jobs;
}

}  // namespace meshsmooth::server
