#include "engine.hpp"

#include <chrono>
#include <thread>
#include <utility>

#include "host_memory.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "resources.hpp"

namespace meshsmooth::server {

std::exception_ptr draining_error() {
  return std::make_exception_ptr(
      Error("DRAINING", "this server is shutting down; send the job to another one"));
}

namespace {

// 4,096 idle ones took 95 MB.
constexpr std::int64_t kConnectionsBytes = 128 << 20;

std::exception_ptr device_lost_error() {
  return std::make_exception_ptr(
      DeviceError("DEVICE_LOST", "the device of this job has no lane left", true));
}

}  // namespace

Engine::Engine(ServerConfig config, const SmootherFactory& factory,
               std::function<void()> on_lanes_lost)
    : Engine(acquire_resources(std::move(config), factory), std::move(on_lanes_lost)) {}

Engine::Engine(Resources resources, std::function<void()> on_lanes_lost)
    : config_(std::move(resources.config)),
      passed_over_(std::move(resources.passed_over)),
      threads_(std::move(resources.threads)),
      staging_(std::move(resources.staging)),
      resident_at_start_bytes_(resources.resident_bytes),
      budget_(std::move(resources.limits)),
      transport_(config_, budget_, page_lock(resources.devices.front().backend)),
      topologies_(budget_, config_.max_topology_bytes),
      queue_(config_.max_queued_jobs, config_.max_queued_bytes, config_.priority_ageing),
      store_(static_cast<std::size_t>(config_.max_kept_jobs),
             {config_.max_jobs_per_caller, config_.max_bytes_per_caller}),
      admission_(config_, *resources.devices.front().smoothers.front(), budget_, topologies_,
                 queue_, store_, staging_.get(), [this](const Job& ended) { retire(ended); }),
      traces_(config_.traces),
      results_(config_.max_kept_result_bytes),
      on_lanes_lost_(std::move(on_lanes_lost)) {
  admission_.check_limits();
  const LaneEvents events{
      .finished = [this](Job& job, SmoothSummary summary) { finish(job, std::move(summary)); },
      .failed = [](Job& job, std::exception_ptr error) { job.end(std::move(error)); }};
  for (const Resources::Device& device : resources.devices) devices_.push_back(device.backend);
  lanes_ = std::make_unique<LanePool>(
      std::move(resources.devices), std::move(resources.make_smoother), queue_, topologies_,
      LanePool::Options{config_.lanes, config_.lane_watchdog},
      LanePool::Events{events, [this](int device) { close_device(device); }});
  try {
    maintenance_ = std::jthread([this](const std::stop_token& stop) { run_maintenance(stop); });
  } catch (...) {  // the lanes end with it
    queue_.close();
    throw;
  }
}

Engine::~Engine() {
  refuse_new();
  stop_all();
  close();
}

wire::MeshLimits Engine::mesh_limits() const {
  return {.max_node_count = config_.max_node_count,
          .max_element_count = config_.max_element_count,
          .max_mesh_bytes = config_.max_job_bytes};
}

// The streams' part of the host memory is not known before.
std::int64_t Engine::transport_bytes() const {
  return config_.host_memory_limit_bytes + kConnectionsBytes;
}

// gRPC took up to four times as much for a header as it has bytes. Each call that uploads has the
// window of its stream reserved.
std::int64_t Engine::unanswered_budget_bytes() const {
  return kConnectionsBytes / 4 + calls_ * Admission::window_bytes(config_);
}

std::int64_t Engine::memory_ceiling_bytes() const {
  return resident_at_start_bytes_ + config_.host_memory_limit_bytes + config_.idle_pinned_bytes +
         kKeptHeapBytes + kConnectionsBytes;
}

// --- the life of a job ---------------------------------------------------------------

Subscription Engine::admit(const JobRequest& request, const Job::Observer& observer) {
  if (draining()) std::rethrow_exception(draining_error());
  results_.expire(Clock::now());  // their memory may be needed
  Subscription subscription = admit_or_make_room(request, observer);
  // A drain that began meanwhile may have searched the store before this job was in it.
  if (!subscription.joined && draining()) {
    subscription.job->end(draining_error());
    std::rethrow_exception(draining_error());
  }
  return subscription;
}

Subscription Engine::admit_or_make_room(const JobRequest& request, const Job::Observer& observer) {
  do {
    try {
      return admission_.admit(request, observer);
    } catch (const OutOfMemory& error) {
      if (error.reason() != "HOST_MEMORY_BUSY" && error.reason() != "DEVICE_MEMORY_BUSY") throw;
    }
  } while (transport_.drop_unredeemed(request.share));
  make_room(Clock::now());
  return admission_.admit(request, observer);
}

void Engine::make_room(Clock::time_point now) {
  // For the next attempt: memory comes back when its callers have heard of it.
  transport_.recall_idle();
  // Many may be refused.
  constexpr auto kInterval = std::chrono::milliseconds(20);
  const Clock::time_point last = memory_short_at_.exchange(now);
  if (last != Clock::time_point::min() && now - last < kInterval) return;
  for (const auto& job : store_.living()) {
    if (job->state() == JobState::receiving) job->notify();
  }
}

bool Engine::memory_short(Clock::time_point now) const {
  constexpr auto kMemory = std::chrono::seconds(2);
  const Clock::time_point last = memory_short_at_;
  return last != Clock::time_point::min() && now - last < kMemory;
}

void Engine::leave(Subscription& subscription, const std::exception_ptr& cause) {
  if (!subscription.job) return;
  const std::shared_ptr<Job> job = std::move(subscription.job);
  const bool brings_mesh = !subscription.joined && job->state() == JobState::receiving;
  const bool last = job->leave(subscription.observer_id, cause);
  if (brings_mesh || (last && job->state() == JobState::sending)) {
    job->end(cause);
  } else if (last) {
    end_waiting(*job, cause);
  }
  subscription.stream = {};
  subscription.stream_share = {};
}

void Engine::submit(const std::shared_ptr<Job>& job) {
  const JobRequest& request = job->request();
  job->keep_topology(topologies_, Admission::topology_bytes(request.layout));
  const std::string& share = request.share_or_caller();
  job->queue(queue_.take_place(share, request.layout.total_bytes()));
  queue_.push(job, {share, job->device(), request.priority});
  if (budget_.closed(job->device())) job->reject(device_lost_error());
  // A stop that came before the push did not find the job in the queue.
  if (job->stop_cause()) end_waiting(*job, job->stop_cause());
}

void Engine::finish(Job& job, SmoothSummary summary) {
  if (!job.finish(std::move(summary))) {
    job.end(job.stop_cause());
  } else if (job.request().kept()) {
    job.end();  // nobody has to send its result first
  }
}

void Engine::complete(Job& job) { job.end(); }

void Engine::cancel(Job& job, std::exception_ptr cause) {
  if (job.request_stop(cause)) end_waiting(job, cause);
}

void Engine::end_waiting(Job& job, std::exception_ptr cause) {
  if (queue_.remove(job)) job.end(cause);
}

void Engine::retire(const Job& job) {
  if (job.request().kept() && job.snapshot().result)
    results_.keep(store_.find(job.request().caller, job.name()));
  for (const auto& forgotten : store_.retire(job)) results_.drop(*forgotten);
  metrics_.job_ended(job);
  log_job_end(job);
  traces_.add(job);
  wake();
}

void Engine::forget(Job& job) {
  while (!store_.forget(job)) {
    if (!has_ended(job.state())) {
      throw Error("JOB_NOT_FINISHED", job.name() + " has not ended; cancel it first",
                  {{"name", job.name()}});
    }
    // Another call was faster; or the store is just being told that the job has ended.
    if (!store_.find(job.request().caller, job.name())) break;
    std::this_thread::yield();
  }
  results_.drop(job);
}

void Engine::call_ended() {
  --calls_;
  wake();
}

// Its waiting jobs would never run.
void Engine::close_device(int device) {
  log_error("device_lost", devices_[static_cast<std::size_t>(device)] + " has no lane left");
  const bool last = budget_.close_device(device);
  for (const auto& job : store_.living()) {
    const std::exception_ptr cause = device_lost_error();
    if (job->device() == device && job->reject(cause)) end_waiting(*job, cause);
  }
  if (last) on_lanes_lost_();
}

// --- drain and maintenance -------------------------------------------------------------

void Engine::refuse_new() {
  draining_ = true;
  transport_.recall();
}

void Engine::reject_waiting() {
  for (const auto& job : store_.living()) {
    const std::exception_ptr cause = draining_error();
    if (job->reject(cause)) end_waiting(*job, cause);
  }
}

void Engine::stop_all() {
  for (const auto& job : store_.living()) cancel(*job, draining_error());
}

void Engine::close() {
  queue_.close();
  lanes_->join();
  transport_.close();
  traces_.close();
}

void Engine::run_maintenance(const std::stop_token& stop) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  while (!stopped.wait_for(lock, stop, kInterval, [] { return false; }) && !stop.stop_requested()) {
    const auto now = Clock::now();
    results_.expire(now);
    lanes_->check_watchdog(now);
    end_late_jobs(now);
  }
}

void Engine::end_late_jobs(Clock::time_point now) {
  const bool limited = config_.max_job_time > ServerConfig::Duration::zero();
  for (const auto& job : store_.living()) {
    if (job->waited_too_long(now)) {
      end_waiting(*job, std::make_exception_ptr(DeadlineExceeded(
                            "QUEUE_TIMEOUT", "the job waited too long in the queue")));
    } else if (limited && job->ran_too_long(now, config_.max_job_time)) {
      cancel(*job, std::make_exception_ptr(DeadlineExceeded(
                       "RUN_TIMEOUT", "the job ran longer than this server allows")));
    }
  }
}

void Engine::wait(Clock::time_point until, const std::atomic<bool>& give_up) {
  std::unique_lock lock(idle_mutex_);
  idle_.wait_until(lock, until, [&] { return give_up.load(); });
}

void Engine::wait_idle(Clock::time_point until, const std::atomic<bool>& give_up) {
  std::unique_lock lock(idle_mutex_);
  idle_.wait_until(lock, until,
                   [&] { return give_up || (calls_ == 0 && store_.living().empty()); });
}

void Engine::wake() {
  { const std::lock_guard lock(idle_mutex_); }
  idle_.notify_all();
}

}  // namespace meshsmooth::server
