#include "jobs.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <utility>

namespace meshsmooth::gateway {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

/// 128 random bits: who knows it may see the job of a caller without a token.
std::string new_id() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Problem("INTERNAL", "the system has no random numbers");
  }
  constexpr const char* kDigits = "0123456789abcdef";
  std::string id;
  for (const unsigned char byte : bytes) {
    id += kDigits[byte >> 4];
    id += kDigits[byte & 15];
  }
  return id;
}

const char* name_of(JobState state) {
  constexpr std::array kNames = {"waiting", "running", "done", "failed", "cancelled"};
  return kNames.at(static_cast<std::size_t>(state));
}

}  // namespace

KeptJob::KeptJob(std::string id, Order order, std::unique_ptr<RequestFolder> folder)
    : id_(std::move(id)), order_(std::move(order)), folder_(std::move(folder)) {}

bool KeptJob::belongs_to(const std::string& token) const {
  // In a time that does not tell how much of it is right.
  const std::string& own = order_.token;
  unsigned difference = own.size() == token.size() ? 0 : 1;
  for (std::size_t n = 0; n < std::min(own.size(), token.size()); ++n) {
    difference |= static_cast<unsigned char>(own[n]) ^ static_cast<unsigned char>(token[n]);
  }
  return difference == 0;
}

json KeptJob::to_json() const {
  const std::lock_guard lock(mutex_);
  json of = {{"id", id_}, {"state", name_of(state_)}};
  if (!progress_.empty()) of["progress"] = progress_;
  if (problem_) of["problem"] = problem_->to_json();
  return of;
}

bool KeptJob::has_ended() const {
  const std::lock_guard lock(mutex_);
  return state_ != JobState::waiting && state_ != JobState::running;
}

std::uint64_t KeptJob::wait(std::uint64_t version, std::chrono::milliseconds longest) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, longest, [&] { return version_ > version; });
  return version_;
}

Outcome KeptJob::outcome() const {
  const std::lock_guard lock(mutex_);
  if (problem_) throw *problem_;
  if (state_ != JobState::done) {
    throw Problem("JOB_NOT_FINISHED", "the job has not ended", {{"name", id_}});
  }
  return outcome_;
}

void KeptJob::change(const std::function<void()>& change) {
  const std::lock_guard lock(mutex_);
  change();
  ++version_;
  changed_.notify_all();
}

void KeptJob::run(Service& service, std::shared_ptr<Service::Place> place) {
  std::optional<Problem> problem;
  Outcome outcome;
  try {
    Interruptions interruptions;
    interruptions.cancel = &cancel_;
    outcome = service.run(order_, *folder_, interruptions, [&](const json& progress) {
      change([&] {
        state_ = JobState::running;
        progress_ = progress;
      });
    });
  } catch (const Problem& failure) {
    problem = failure;
  } catch (const std::exception& failure) {
    problem = Problem("INTERNAL", failure.what());
  }
  place.reset();  // before anybody hears of the end
  change([&] {
    ended_ = Clock::now();
    problem_ = problem;
    outcome_ = outcome;
    state_ = !problem                                       ? JobState::done
             : problem->reason() == "CANCELLED_BY_JOB_CALL" ? JobState::cancelled
                                                            : JobState::failed;
  });
}

JobStore::JobStore(Service& service)
    : service_(service), maintenance_([this](const std::stop_token& stop) {
        std::unique_lock lock(mutex_);
        while (!stop.stop_requested()) {
          wake_.wait_for(lock, stop, std::chrono::seconds(1), [] { return false; });
          lock.unlock();
          expire(false);
          lock.lock();
        }
      }) {}

JobStore::~JobStore() {
  maintenance_.request_stop();
  maintenance_.join();
  for (const Entry& entry : jobs_) entry.job->cancel();
}

std::shared_ptr<KeptJob> JobStore::start(Order order, std::unique_ptr<RequestFolder> folder,
                                         std::shared_ptr<Service::Place> place) {
  auto job = std::make_shared<KeptJob>(new_id(), std::move(order), std::move(folder));
  expire(true);
  const std::lock_guard lock(mutex_);
  if (std::ssize(jobs_) >= service_.settings().max_kept_jobs) {
    throw Problem("QUEUE_FULL", "the gateway keeps " + std::to_string(jobs_.size()) +
                                    " jobs that have not ended (--max-kept-jobs)");
  }
  jobs_.push_back({job, std::jthread([this, job, place = std::move(place)]() mutable {
                     job->run(service_, std::move(place));
                   })});
  return job;
}

std::shared_ptr<KeptJob> JobStore::find(const std::string& id, const std::string& token) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::ranges::find_if(jobs_, [&](const Entry& entry) { return entry.job->id() == id; });
  if (found != jobs_.end() && found->job->belongs_to(token)) return found->job;
  throw Problem("JOB_NOT_FOUND", "there is no such job, or its time is over", {{"name", id}});
}

void JobStore::remove(const std::string& id, const std::string& token) {
  const std::shared_ptr<KeptJob> job = find(id, token);
  job->cancel();
  if (!job->has_ended()) return;
  const std::lock_guard lock(mutex_);
  std::erase_if(jobs_, [&](const Entry& entry) { return entry.job == job; });
}

void JobStore::expire(bool one) {
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  std::erase_if(jobs_, [&](const Entry& entry) {
    return entry.job->has_ended() && now - entry.job->ended_ >= service_.settings().result_ttl;
  });
  if (!one || std::ssize(jobs_) < service_.settings().max_kept_jobs) return;
  const auto ended =
      std::ranges::find_if(jobs_, [](const Entry& entry) { return entry.job->has_ended(); });
  if (ended != jobs_.end()) jobs_.erase(ended);
}

}  // namespace meshsmooth::gateway
