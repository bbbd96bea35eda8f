#include "job.hpp"

#include <algorithm>
#include <iterator>
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

// The request is retained as long as the job is listed, its memory only until its end.
JobRequest without_memory(const JobRequest& request) {
  JobRequest copy = request;
  copy.topology = nullptr;
  copy.coordinates_in_place.reset();
  return copy;
}

std::unique_ptr<wire::MeshAssembler> make_mesh(wire::MeshLayout layout,
                                               const std::shared_ptr<CachedTopology>& topology,
                                               const std::optional<CoordinatesInPlace>& in_place,
                                               std::pmr::memory_resource* memory) {
  auto arrays = topology ? topology->arrays() : nullptr;
  if (!in_place) {
    return std::make_unique<wire::MeshAssembler>(std::move(layout), std::move(arrays), memory);
  }
  layout.coordinates_follow = false;
  return std::make_unique<wire::MeshAssembler>(std::move(layout), std::move(arrays), memory,
                                               wire::ByteArray(in_place->result, in_place->owner));
}

}  // namespace

JobResult::Part JobResult::part_at(std::int64_t offset_bytes) const {
  auto offset = static_cast<std::size_t>(offset_bytes);
  const auto positions = coordinates.bytes();
  if (offset < positions.size()) {
    return {v1::ARRAY_ID_COORDINATES, offset_bytes, positions.subspan(offset)};
  }
  offset -= positions.size();
  return {v1::ARRAY_ID_ELEMENT_QUALITY, static_cast<std::int64_t>(offset),
          std::as_bytes(std::span(element_quality)).subspan(offset)};
}

Job::Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
         std::int64_t result_bytes, UploadShare upload, std::pmr::memory_resource* memory,
         EndObserver end_observer)
    : name_(std::move(name)),
      sequence_(sequence),
      request_(without_memory(request)),
      reserved_bytes_(reservation.bytes()),
      device_(reservation.device()),
      result_bytes_(result_bytes),
      end_observer_(std::move(end_observer)),
      reservation_(std::move(reservation)),
      topology_(std::move(request.topology)),
      upload_(std::move(upload)),
      mesh_(make_mesh(request_.layout, topology_, request.coordinates_in_place, memory)),
      given_in_place_(request.coordinates_in_place
                          ? std::optional(request.coordinates_in_place->given)
                          : std::nullopt) {
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

std::optional<int> Job::observe(Observer observer, bool of_progress) {
  const std::lock_guard lock(mutex_);
  if (!joinable_now()) return std::nullopt;
  observers_.push_back({next_observer_id_, std::move(observer), of_progress});
  return next_observer_id_++;
}

bool Job::leave(int observer_id, const std::exception_ptr& cause) {
  std::shared_ptr<const JobResult> dropped;  // destroyed without the lock
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(observers_, [=](const Registration& r) { return r.id == observer_id; });
    if (!observers_.empty() || request_.kept()) return false;
    if (has_ended(now_.state)) {
      dropped = std::move(now_.result);
      return false;
    }
    if (!stop_cause_) stop_requested_ = Clock::now();
    if (!stop_cause_) stop_cause_ = cause;  // from now on no call can join
  }
  stop_.request_stop();
  return true;
}

void Job::notify(bool of_progress) const {
  std::vector<Registration> observers;
  {
    const std::lock_guard lock(mutex_);
    std::ranges::copy_if(observers_, std::back_inserter(observers),
                         [&](const Registration& r) { return !of_progress || r.of_progress; });
  }
  for (const Registration& registration : observers) registration.observer();
}

PositionsView Job::given_positions() {
  if (given_in_place_) return wire::positions_in(*given_in_place_, request_.layout.float64);
  return as_view(mesh_->positions());
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
      request_.caller, mesh_->topology_name(), request_.layout, arrays, std::move(reservation)));
  const std::lock_guard lock(mutex_);
  topology_ = std::move(topology);
  now_.topology_name = topology_->name();
}

void Job::note_topology_reused() {
  const std::lock_guard lock(mutex_);
  now_.topology_reused = true;
}

void Job::queue(QueuePlace place) {
  UploadShare upload;
  const std::lock_guard lock(mutex_);
  upload = std::move(upload_);
  place_ = std::move(place);
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

bool Job::finish(SmoothSummary summary) {
  Reservation rest;  // of what only the run needed; returned after its bytes
  std::shared_ptr<CachedTopology> topology;
  std::unique_ptr<wire::MeshAssembler> mesh;
  auto result = std::make_shared<JobResult>();
  {
    const std::lock_guard lock(mutex_);
    now_.times.finished = Clock::now();
    if (stop_cause_) return false;
    mesh = std::move(mesh_);
    topology = std::move(topology_);
    result->coordinates = mesh->take_coordinates();
    result->element_quality = std::move(summary.element_quality.values);
    result->reservation = reservation_.split({result_bytes_, 0});
    rest = std::move(reservation_);
    now_.result = std::move(result);
    now_.state = JobState::sending;
    now_.summary = std::make_shared<const SmoothSummary>(std::move(summary));
  }
  mesh.reset();
  topology.reset();
  { const Reservation freed = std::move(rest); }
  if (!request_.kept()) notify();  // a kept job ends at once
  return true;
}

bool Job::end(std::exception_ptr error) {
  {
    // Destroyed before the observers are notified, in reverse order, outside the lock.
    Reservation reservation;
    UploadShare upload, caller_share;
    QueuePlace place;
    std::shared_ptr<CachedTopology> topology;
    std::unique_ptr<wire::MeshAssembler> mesh;
    std::shared_ptr<const JobResult> result;
    const std::lock_guard lock(mutex_);
    if (has_ended(now_.state)) return false;
    if (error && stop_cause_) error = stop_cause_;
    if (!error) stop_cause_ = nullptr;  // too late
    now_.state = !error                ? JobState::succeeded
                 : is_cancelled(error) ? JobState::cancelled
                                       : JobState::failed;
    now_.times.ended = Clock::now();
    now_.times.ended_wall = std::chrono::system_clock::now();
    if (error || (observers_.empty() && !request_.kept())) result = std::move(now_.result);
    if (now_.result && request_.kept()) {
      now_.times.expires_wall =
          now_.times.ended_wall +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(*request_.result_ttl);
    }
    now_.error = std::move(error);
    mesh = std::move(mesh_);
    topology = std::move(topology_);
    upload = std::move(upload_);
    caller_share = std::move(caller_share_);
    place = std::move(place_);
    reservation = std::move(reservation_);
  }
  end_observer_(*this);
  notify();
  return true;
}

void Job::reserve_more(std::int64_t host_bytes) {
  const std::lock_guard lock(mutex_);
  reservation_.grow(host_bytes);
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

bool Job::reject(std::exception_ptr cause) {
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
         observers_.size() <= 1;
}

bool Job::waited_too_long(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return now_.state == JobState::queued && request_.queue_timeout &&
         now - *now_.times.queued >= *request_.queue_timeout;
}

bool Job::ran_too_long(Clock::time_point now, Clock::duration limit) const {
  const std::lock_guard lock(mutex_);
  return now_.state == JobState::running && now - *now_.times.started >= limit;
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
  notify(true);
}

JobState Job::state() const {
  const std::lock_guard lock(mutex_);
  return now_.state;
}

bool Job::has_result() const {
  const std::lock_guard lock(mutex_);
  return now_.result != nullptr;
}

JobSnapshot Job::snapshot() const {
  const std::lock_guard lock(mutex_);
  JobSnapshot snapshot = now_;
  snapshot.stop_cause = stop_cause_;
  return snapshot;
}

}  // namespace meshsmooth::server
