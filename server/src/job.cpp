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

// The request lives as long as anybody knows of the job, the topology only until its end.
JobRequest without_topology(const JobRequest& request) {
  JobRequest copy = request;
  copy.topology = nullptr;
  return copy;
}

}  // namespace

Job::Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
         std::int64_t result_bytes, QueuePlace place, std::pmr::memory_resource* memory,
         EndObserver end_observer)
    : name_(std::move(name)),
      sequence_(sequence),
      request_(without_topology(request)),
      reserved_bytes_(reservation.bytes()),
      device_(reservation.device()),
      result_bytes_(result_bytes),
      end_observer_(std::move(end_observer)),
      reservation_(std::move(reservation)),
      topology_(std::move(request.topology)),
      place_(std::move(place)),
      mesh_(topology_ ? std::make_unique<wire::MeshAssembler>(request_.layout, topology_->arrays(),
                                                              memory)
                      : std::make_unique<wire::MeshAssembler>(request_.layout, memory)) {
  if (topology_) now_.topology_name = topology_->name();
  if (request_.topology_kept) mesh_->name_topology();
  now_.times.created = std::chrono::system_clock::now();
  now_.times.admitted = Clock::now();
}

bool Job::joinable_now() const {
  return !stop_cause_ && (!has_ended(now_.state) || (request_.kept() && now_.result));
}

bool Job::joinable() const {
  const std::lock_guard lock(mutex_);
  return joinable_now();
}

std::optional<int> Job::watch(Observer observer) {
  const std::lock_guard lock(mutex_);
  if (!joinable_now()) return std::nullopt;
  watchers_.push_back({next_watcher_, std::move(observer)});
  return next_watcher_++;
}

bool Job::leave(int watcher, const std::exception_ptr& cause) {
  std::shared_ptr<const JobResult> dropped;  // destroyed without the lock
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(watchers_, [=](const Watcher& w) { return w.number == watcher; });
    if (!watchers_.empty() || request_.kept()) return false;
    if (has_ended(now_.state)) {
      dropped = std::move(now_.result);
      return false;
    }
    if (!stop_cause_) stop_requested_ = Clock::now();
    if (!stop_cause_) stop_cause_ = cause;  // from now on nobody can join
  }
  stop_.request_stop();
  return true;
}

void Job::notify() const {
  std::vector<Watcher> watchers;
  {
    const std::lock_guard lock(mutex_);
    watchers = watchers_;
  }
  for (const Watcher& watcher : watchers) watcher.observer();
}

std::shared_ptr<CachedTopology> Job::topology() const {
  const std::lock_guard lock(mutex_);
  return topology_;
}

void Job::keep_topology(TopologyCache& cache, std::int64_t bytes) {
  if (!request_.topology_kept) return;
  Reservation reservation;
  const auto arrays = mesh_->topology_arrays();
  {
    const std::lock_guard lock(mutex_);
    reservation = reservation_.split({bytes, 0});
  }
  auto topology = cache.add(std::make_shared<CachedTopology>(
      request_.identity, mesh_->topology_name(), request_.layout, arrays, std::move(reservation)));
  const std::lock_guard lock(mutex_);
  topology_ = std::move(topology);
  now_.topology_name = topology_->name();
}

void Job::note_topology_reused() {
  const std::lock_guard lock(mutex_);
  now_.topology_reused = true;
}

void Job::queue() {
  const std::lock_guard lock(mutex_);
  now_.state = JobState::queued;
  now_.times.queued = Clock::now();
}

bool Job::start() {
  QueuePlace place;
  {
    const std::lock_guard lock(mutex_);
    if (stop_cause_) return false;
    now_.state = JobState::running;
    now_.times.started = Clock::now();
    place = std::move(place_);
  }
  notify();
  return true;
}

void Job::finish(SmoothSummary summary) {
  std::exception_ptr cause;
  Reservation rest;  // of what only the run needed; after its bytes
  std::shared_ptr<CachedTopology> topology;
  std::unique_ptr<wire::MeshAssembler> mesh;
  auto result = std::make_shared<JobResult>();
  {
    const std::lock_guard lock(mutex_);
    now_.times.finished = Clock::now();
    cause = stop_cause_;  // whoever asked for the stop may be gone: nobody would send
    if (!cause) {
      mesh = std::move(mesh_);
      topology = std::move(topology_);
      result->coordinates = mesh->take_coordinates();
      result->reservation = reservation_.split({result_bytes_, 0});
      rest = std::move(reservation_);
      now_.result = std::move(result);
      now_.state = JobState::sending;
      now_.summary = std::make_shared<const SmoothSummary>(std::move(summary));
    }
  }
  if (cause) {
    end(cause);
    return;
  }
  mesh.reset();
  topology.reset();
  { const Reservation freed = std::move(rest); }
  if (request_.kept()) {
    end();
  } else {
    notify();
  }
}

bool Job::end(std::exception_ptr error) {
  {
    // Destroyed before the observers hear, in reverse order, outside the lock.
    Reservation reservation;
    QueuePlace place;
    std::shared_ptr<CachedTopology> topology;
    std::unique_ptr<wire::MeshAssembler> mesh;
    std::shared_ptr<const JobResult> result;
    const std::lock_guard lock(mutex_);
    if (has_ended(now_.state)) return false;
    if (error && stop_cause_) error = stop_cause_;
    if (!error) stop_cause_ = nullptr;  // it came too late
    now_.state = !error                ? JobState::succeeded
                 : is_cancelled(error) ? JobState::cancelled
                                       : JobState::failed;
    now_.times.ended = Clock::now();
    now_.times.ended_wall = std::chrono::system_clock::now();
    if (error || (watchers_.empty() && !request_.kept())) result = std::move(now_.result);
    if (now_.result && request_.kept()) {
      now_.times.expires_wall =
          now_.times.ended_wall +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(*request_.result_ttl);
    }
    now_.error = std::move(error);
    mesh = std::move(mesh_);
    topology = std::move(topology_);
    place = std::move(place_);
    reservation = std::move(reservation_);
  }
  end_observer_(*this);
  notify();
  return true;
}

void Job::expire() {
  std::shared_ptr<const JobResult> result;
  const std::lock_guard lock(mutex_);
  if (now_.state != JobState::succeeded || !now_.result) return;
  now_.state = JobState::expired;
  result = std::move(now_.result);
}

bool Job::request_stop(std::exception_ptr cause) {
  return request_stop(std::move(cause), [](JobState state) { return !has_ended(state); });
}

bool Job::hand_back(std::exception_ptr cause) {
  return request_stop(std::move(cause), [](JobState state) {
    return state == JobState::receiving || state == JobState::queued;
  });
}

bool Job::request_stop(std::exception_ptr cause, bool (*may_stop)(JobState)) {
  {
    const std::lock_guard lock(mutex_);
    if (!may_stop(now_.state) || stop_cause_) return false;
    stop_cause_ = std::move(cause);
    stop_requested_ = Clock::now();
  }
  stop_.request_stop();
  notify();
  return true;
}

Clock::duration Job::stopping_for(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return stop_cause_ ? now - stop_requested_ : Clock::duration::zero();
}

bool Job::past_deadline(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return request_.deadline && now >= *request_.deadline && !request_.kept() &&
         watchers_.size() <= 1;
}

bool Job::waited_too_long(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return now_.state == JobState::queued && request_.queue_timeout &&
         now - *now_.times.queued >= *request_.queue_timeout;
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
  notify();
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
