#include "job_store.hpp"

#include <algorithm>
#include <utility>

#include "job.hpp"

namespace meshsmooth::server {
namespace {

std::pair<std::string, std::string> request_key(const Job& job) {
  return {job.request().identity, job.request().request_id};
}

}  // namespace

bool JobStore::add(const std::shared_ptr<Job>& job) {
  const std::lock_guard lock(mutex_);
  if (!job->request().request_id.empty()) {
    std::shared_ptr<Job>& newest = by_request_[request_key(*job)];
    if (newest && newest->joinable()) return false;
    newest = job;
  }
  living_.emplace(job->sequence(), job);
  by_name_.emplace(job->name(), job);
  return true;
}

std::vector<std::shared_ptr<Job>> JobStore::retire(const Job& job) {
  const std::lock_guard lock(mutex_);
  ended_.insert(living_.extract(job.sequence()));
  std::vector<std::shared_ptr<Job>> forgotten;
  while (ended_.size() > max_ended_jobs_) {
    forgotten.push_back(ended_.begin()->second);
    ended_.erase(ended_.begin());
    unlink(forgotten.back());
  }
  return forgotten;
}

bool JobStore::forget(const Job& job) {
  std::shared_ptr<Job> forgotten;  // destroyed after the lock
  const std::lock_guard lock(mutex_);
  const auto found = ended_.find(job.sequence());
  if (found == ended_.end()) return false;
  forgotten = found->second;
  ended_.erase(found);
  unlink(forgotten);
  return true;
}

void JobStore::unlink(const std::shared_ptr<Job>& job) {
  by_name_.erase(job->name());
  const auto found = by_request_.find(request_key(*job));
  if (found != by_request_.end() && found->second == job) by_request_.erase(found);
}

std::shared_ptr<Job> JobStore::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

std::shared_ptr<Job> JobStore::find_request(const std::string& identity,
                                            const std::string& request_id) const {
  if (request_id.empty()) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto found = by_request_.find({identity, request_id});
  return found == by_request_.end() ? nullptr : found->second;
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
