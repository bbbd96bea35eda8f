#include "job_store.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "job.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::pair<std::string, std::string> request_key(const Job& job) {
  return {job.request().caller, job.request().request_id};
}

}  // namespace

bool JobStore::add(const std::shared_ptr<Job>& job) {
  const std::lock_guard lock(mutex_);
  const bool named = !job->request().request_id.empty();
  const auto before = named ? by_request_.find(request_key(*job)) : by_request_.end();
  if (before != by_request_.end() && before->second->joinable()) return false;
  check_quota(*job);
  if (named) by_request_[request_key(*job)] = job;
  living_.emplace(job->sequence(), job);
  by_name_.emplace(job->name(), job);
  return true;
}

std::vector<std::shared_ptr<Job>> JobStore::retire(const Job& job) {
  const std::lock_guard lock(mutex_);
  ended_.insert(living_.extract(job.sequence()));
  ended_of_[job.request().share_or_caller()].insert(job.sequence());
  std::vector<std::shared_ptr<Job>> forgotten;
  while (ended_.size() > max_ended_jobs_) forgotten.push_back(take_surplus());
  return forgotten;
}

std::shared_ptr<Job> JobStore::take_surplus() {
  const auto& [share, sequences] = *std::ranges::max_element(
      ended_of_, {}, [](const auto& entry) { return entry.second.size(); });
  const auto dispensable = std::ranges::find_if(
      sequences, [&](std::int64_t sequence) { return !ended_.at(sequence)->has_result(); });
  std::shared_ptr<Job> job =
      ended_.at(dispensable == sequences.end() ? *sequences.begin() : *dispensable);
  erase_ended(job);
  return job;
}

void JobStore::erase_ended(const std::shared_ptr<Job>& job) {
  ended_.erase(job->sequence());
  const auto of_share = ended_of_.find(job->request().share_or_caller());
  of_share->second.erase(job->sequence());
  if (of_share->second.empty()) ended_of_.erase(of_share);
  unlink(job);
}

bool JobStore::forget(const Job& job) {
  std::shared_ptr<Job> forgotten;  // destroyed after the lock
  const std::lock_guard lock(mutex_);
  const auto found = ended_.find(job.sequence());
  if (found == ended_.end()) return false;
  forgotten = found->second;
  erase_ended(forgotten);
  return true;
}

void JobStore::unlink(const std::shared_ptr<Job>& job) {
  by_name_.erase(job->name());
  const auto found = by_request_.find(request_key(*job));
  if (found != by_request_.end() && found->second == job) by_request_.erase(found);
}

void JobStore::check_quota(const Job& job) const {
  const auto size = [](const Job& of) {
    return of.reserved_bytes().host_bytes + of.reserved_bytes().device_bytes;
  };
  int jobs = 1;
  std::int64_t bytes = size(job);
  if (quota_.max_bytes != 0 && bytes > quota_.max_bytes) {
    throw OutOfMemory(
        "MESH_TOO_LARGE",
        "the job needs " + std::to_string(bytes) + " bytes, the limit for one caller is " +
            std::to_string(quota_.max_bytes),
        {{"need_bytes", std::to_string(bytes)}, {"limit_bytes", std::to_string(quota_.max_bytes)}});
  }
  for (const auto& [sequence, other] : living_) {
    if (other->request().caller != job.request().caller) continue;
    ++jobs;
    bytes += size(*other);
  }
  if (quota_.max_jobs != 0 && jobs > quota_.max_jobs) {
    throw OutOfMemory("QUOTA_EXCEEDED",
                      "one caller may have " + std::to_string(quota_.max_jobs) +
                          " unfinished jobs; wait until one of them ends",
                      {{"limit_jobs", std::to_string(quota_.max_jobs)}});
  }
  if (quota_.max_bytes != 0 && bytes > quota_.max_bytes) {
    throw OutOfMemory("QUOTA_EXCEEDED",
                      "the unfinished jobs of one caller may reserve " +
                          std::to_string(quota_.max_bytes) + " bytes; wait until one of them ends",
                      {{"limit_bytes", std::to_string(quota_.max_bytes)}});
  }
}

std::shared_ptr<Job> JobStore::find(const std::string& caller, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = by_name_.find(name);
  if (found == by_name_.end() || found->second->request().caller != caller) return nullptr;
  return found->second;
}

std::shared_ptr<Job> JobStore::find_request(const std::string& caller,
                                            const std::string& request_id) const {
  if (request_id.empty()) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto found = by_request_.find({caller, request_id});
  return found == by_request_.end() ? nullptr : found->second;
}

std::vector<std::shared_ptr<Job>> JobStore::list(
    const std::string& caller, std::int64_t before, std::size_t count,
    const std::function<bool(const Job&)>& wanted) const {
  std::vector<std::shared_ptr<Job>> jobs;
  {
    const std::lock_guard lock(mutex_);
    for (const auto* part : {&living_, &ended_}) {
      for (const auto& [sequence, job] : *part) {
        if (sequence < before && job->request().caller == caller) jobs.push_back(job);
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
