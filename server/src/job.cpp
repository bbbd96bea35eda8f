#include "job.hpp"

#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

bool is_cancelled(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const Cancelled&) {
    return true;
  } catch (...) {
    return false;
  }
}

}  // namespace

bool has_ended(JobState state) {
  return state == JobState::succeeded || state == JobState::failed || state == JobState::cancelled;
}

const char* state_name(JobState state) {
  switch (state) {
    case JobState::receiving:
      return "receiving";
    case JobState::queued:
      return "queued";
    case JobState::running:
      return "running";
    case JobState::sending:
      return "sending";
    case JobState::succeeded:
      return "succeeded";
    case JobState::failed:
      return "failed";
    case JobState::cancelled:
      return "cancelled";
  }
  __builtin_unreachable();
}

Job::Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
         QueuePlace place, std::pmr::memory_resource* memory, EndObserver end_observer,
         Observer observer)
    : name_(std::move(name)),
      sequence_(sequence),
      request_(std::move(request)),
      reserved_bytes_(reservation.bytes()),
      end_observer_(std::move(end_observer)),
      observer_(std::move(observer)),
      reservation_(std::move(reservation)),
      place_(std::move(place)),
      mesh_(std::make_unique<wire::MeshAssembler>(request_.layout, memory)) {
  now_.times.created = std::chrono::system_clock::now();
  now_.times.admitted = Clock::now();
}

void Job::queue() {
  const std::lock_guard lock(mutex_);
  now_.state = JobState::queued;
  now_.times.queued = Clock::now();
}

void Job::start() {
  QueuePlace place;
  {
    const std::lock_guard lock(mutex_);
    now_.state = JobState::running;
    now_.times.started = Clock::now();
    place = std::move(place_);
  }
  observer_();
}

void Job::finish(SmoothSummary summary) {
  std::exception_ptr cause;
  {
    const std::lock_guard lock(mutex_);
    now_.times.finished = Clock::now();
    cause = stop_cause_;  // whoever asked for the stop may be gone: nobody would send
    if (!cause) {
      now_.state = JobState::sending;
      now_.summary = std::make_shared<const SmoothSummary>(std::move(summary));
    }
  }
  if (cause) {
    end(cause);
  } else {
    observer_();
  }
}

bool Job::end(std::exception_ptr error) {
  {
    // Destroyed before the observers hear, in reverse order, outside the lock.
    Reservation reservation;
    QueuePlace place;
    std::unique_ptr<wire::MeshAssembler> mesh;
    const std::lock_guard lock(mutex_);
    if (has_ended(now_.state)) return false;
    if (error && stop_cause_) error = stop_cause_;
    now_.state = !error                ? JobState::succeeded
                 : is_cancelled(error) ? JobState::cancelled
                                       : JobState::failed;
    now_.error = std::move(error);
    now_.times.ended = Clock::now();
    now_.times.ended_wall = std::chrono::system_clock::now();
    mesh = std::move(mesh_);
    place = std::move(place_);
    reservation = std::move(reservation_);
  }
  end_observer_(*this);
  observer_();
  return true;
}

bool Job::request_stop(std::exception_ptr cause) {
  {
    const std::lock_guard lock(mutex_);
    if (has_ended(now_.state) || stop_cause_) return false;
    stop_cause_ = std::move(cause);
    now_.times.stop_requested = Clock::now();
  }
  stop_.request_stop();
  observer_();
  return true;
}

std::exception_ptr Job::stop_cause() const {
  const std::lock_guard lock(mutex_);
  return stop_cause_;
}

void Job::report(const Progress& progress) {
  {
    const std::lock_guard lock(mutex_);
    now_.progress = progress;
    ++now_.progress_count;
  }
  observer_();
}

JobState Job::state() const {
  const std::lock_guard lock(mutex_);
  return now_.state;
}

JobSnapshot Job::snapshot() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

}  // namespace meshsmooth::server
