#include "lane.hpp"

#include <exception>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

Lane::Lane(std::unique_ptr<Smoother> smoother, Place place, JobQueue& queue,
           TopologyCache& topologies, LaneEvents events)
    : smoother_(std::move(smoother)),
      place_(place),
      queue_(queue),
      topologies_(topologies),
      events_(std::move(events)),
      thread_([this] { run(); }) {}

void Lane::join() {
  const std::lock_guard lock(joining_);
  if (thread_.joinable()) thread_.join();
}

void Lane::run() {
  while (!lost_ && !retired_) {
    const std::shared_ptr<Job> job = queue_.pop(place_.device, place_.takes);
    if (!job) break;
    set_job(job);
    run_job(*job);
    set_job(nullptr);
    queue_.done(job->request().share_or_caller());
  }
  if (lost_) events_.lost();
  ended_ = true;
}

void Lane::set_job(std::shared_ptr<Job> job) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (busy_since_) busy_before_ += now - *busy_since_;
  busy_since_ = job ? std::optional(now) : std::nullopt;
  job_.swap(job);
}

bool Lane::ignores_stop(Clock::time_point now, Clock::duration patience) const {
  const std::lock_guard lock(mutex_);
  return job_ && job_->stopping_for(now) > patience;
}

bool Lane::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_since_.has_value();
}

double Lane::busy_seconds() const {
  const std::lock_guard lock(mutex_);
  const auto running = busy_since_ ? Clock::now() - *busy_since_ : Clock::duration{};
  return std::chrono::duration<double>(busy_before_ + running).count();
}

void Lane::run_job(Job& job) {
  if (job.past_deadline(Clock::now())) {
    return events_.failed(
        job, std::make_exception_ptr(DeadlineExceeded(
                 "DEADLINE_IN_QUEUE", "the deadline passed before the job could run")));
  }
  if (!job.start()) return events_.failed(job, job.stop_cause());
  // No deadline: a call ends by its own, and the last call ends the job.
  const JobControl control{
      .stop = job.stop_token(),
      .finish_early = &job.finish_early_flag(),
      .deadline = {},
      .on_progress = [&job](const Progress& progress) { job.report(progress); },
      .on_extra_memory = [&job](std::int64_t bytes) { job.reserve_more(bytes); }};
  try {
    events_.finished(job, smooth(job, control));
  } catch (const DeviceError& error) {
    if (error.fatal()) lost_ = true;
    events_.failed(job, std::current_exception());
  } catch (...) {
    events_.failed(job, std::current_exception());
  }
}

SmoothSummary Lane::smooth(Job& job, const JobControl& control) {
  wire::MeshAssembler& mesh = job.mesh();
  const SmoothOptions& options = job.request().options;
  const std::optional<SurfaceMesh> surface = mesh.surface();
  JobPositions positions(job.given_positions(), mesh.positions());
  positions.kept_on_error = false;  // a job that fails has no result
  positions.input.node_pairs = mesh.node_pairs();
  if (surface) positions.input.surface = &*surface;
  if (is_motion(options.method)) {
    positions.input.prescribed = mesh.prescribed();
    if (mesh.layout().cotangents) positions.input.cotangent = positions.given;
    if (position_count(mesh.reference()) > 0) positions.given = mesh.reference();
  } else if (aims_at_reference(options)) {
    positions.input.reference = mesh.reference();
  }
  const auto topology = job.topology();
  if (!topology) return smoother_->smooth(mesh.topology(), positions, options, control);
  const PreparedForJob prepared =
      topologies_.prepare(*topology, *smoother_, place_.device, control);
  if (prepared.reused) job.note_topology_reused();
  return smoother_->smooth(*prepared.topology, positions, options, control);
}

}  // namespace meshsmooth::server
