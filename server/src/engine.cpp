#include "engine.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <thread>
#include <utility>

#include "equipment.hpp"
#include "host_memory.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::string random_instance() {
  constexpr char kDigits[] = "0123456789abcdef";
  std::random_device random;
  std::string text(8, '0');
  for (char& digit : text) digit = kDigits[random() % 16];
  return text;
}

// What a stream holds beside the mesh: gRPC's window (grown by itself up to
// 8 MiB, measured), the chunk just read and the one being written.
std::int64_t stream_bytes(const ServerConfig& config) {
  constexpr std::int64_t kAdaptiveWindowBytes = 8 << 20;
  const std::int64_t window =
      config.stream_window_bytes > 0 ? config.stream_window_bytes : kAdaptiveWindowBytes;
  return window + 2 * std::int64_t{config.max_receive_message_bytes};
}

// What the unfinished uploads of one connection may reserve.
MemoryEstimate upload_limit(const ServerConfig& config, const MemoryBytes& limit) {
  const auto share = [&](std::int64_t bytes) {
    return bytes == INT64_MAX ? bytes
                              : static_cast<std::int64_t>(config.max_connection_upload_share *
                                                          static_cast<double>(bytes));
  };
  std::int64_t device_bytes = 0;  // of all devices, unless one of them is the host
  for (const std::int64_t bytes : limit.device_bytes) {
    device_bytes = bytes > INT64_MAX - device_bytes ? INT64_MAX : device_bytes + bytes;
  }
  return {.host_bytes = share(limit.host_bytes), .device_bytes = share(device_bytes)};
}

// The first field in which two requests differ; empty when in none.
std::string differing_field(const std::map<std::string, std::string>& a,
                            const std::map<std::string, std::string>& b) {
  for (const auto* from : {&a, &b}) {
    for (const auto& [name, bytes] : *from) {
      const auto* const other = from == &a ? &b : &a;
      const auto found = other->find(name);
      if (found == other->end() || found->second != bytes) return name;
    }
  }
  return {};
}

}  // namespace

std::exception_ptr draining_error() {
  return std::make_exception_ptr(
      Error("DRAINING", "this server is shutting down; send the job to another one"));
}

std::exception_ptr queue_timeout_error() {
  return std::make_exception_ptr(
      DeadlineExceeded("QUEUE_TIMEOUT", "the job waited too long in the queue"));
}

Engine::Engine(ServerConfig config, const SmootherFactory& factory,
               const std::function<void()>& on_lane_broken)
    : Engine(equip(std::move(config), factory), on_lane_broken) {}

Engine::Engine(Equipment equipment, const std::function<void()>& on_lane_broken)
    : config_(std::move(equipment.config)),
      passed_over_(std::move(equipment.passed_over)),
      threads_(std::move(equipment.threads)),
      staging_(std::move(equipment.staging)),
      resident_at_start_bytes_(equipment.resident_bytes),
      instance_(random_instance()),
      ledger_(std::move(equipment.limits)),
      topologies_(ledger_, config_.max_topology_bytes),
      queue_(config_.max_queued_jobs, config_.max_queued_bytes,
             std::chrono::duration_cast<Clock::duration>(
                 std::chrono::duration<double>(config_.priority_ageing_seconds))),
      uploads_(upload_limit(config_, ledger_.limit())),
      store_(static_cast<std::size_t>(config_.max_kept_jobs),
             {config_.max_jobs_per_identity, config_.max_bytes_per_identity}),
      results_(config_.max_kept_result_bytes) {
  for (Equipment::Device& device : equipment.devices) {
    const int index = static_cast<int>(devices_.size());
    devices_.push_back(device.backend);
    for (auto& smoother : device.smoothers) {
      lanes_.push_back(
          std::make_unique<Lane>(std::move(smoother), index, queue_, topologies_, on_lane_broken));
    }
  }
  housekeeper_ = std::jthread([this](const std::stop_token& stop) { keep_house(stop); });
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

MemoryEstimate Engine::estimate(const JobRequest& request) const {
  const MemoryEstimate own =
      lanes_.front()->smoother().estimate(request.layout.size(), request.options);
  const MemoryEstimate need{
      .host_bytes = array_bytes(request.layout) + own.host_bytes + stream_bytes(config_),
      .device_bytes = own.device_bytes};
  ledger_.check_fits(need);
  if (need.host_bytes > config_.max_job_bytes) {
    throw OutOfMemory("MESH_TOO_LARGE",
                      "the job needs " + std::to_string(need.host_bytes) +
                          " bytes, this server gives a job at most " +
                          std::to_string(config_.max_job_bytes),
                      {{"need_bytes", std::to_string(need.host_bytes)},
                       {"limit_bytes", std::to_string(config_.max_job_bytes)}});
  }
  return need;
}

std::int64_t Engine::memory_ceiling_bytes() const {
  constexpr std::int64_t kConnectionsBytes = 64 << 20;
  return resident_at_start_bytes_ + config_.host_memory_limit_bytes + config_.idle_pinned_bytes +
         kKeptHeapBytes + kConnectionsBytes;
}

std::int64_t Engine::array_bytes(const wire::MeshLayout& layout) const {
  return array_bytes(layout.elements_bytes) + array_bytes(layout.fixed_mask_bytes) +
         array_bytes(layout.element_tags_bytes) + array_bytes(layout.coordinates_bytes);
}

std::int64_t Engine::array_bytes(std::int64_t bytes) const {
  return static_cast<std::int64_t>(StagingMemory::block_bytes(static_cast<std::size_t>(bytes)));
}

Attendance Engine::admit(JobRequest request, const Job::Observer& observer) {
  // The second time only when another call with this request id was faster.
  for (;;) {
    if (draining()) std::rethrow_exception(draining_error());
    if (auto joined = join(request, observer)) return std::move(*joined);
    results_.expire(Clock::now());
    const std::vector<int> resident =
        request.topology ? request.topology->devices() : std::vector<int>{};
    const MemoryEstimate need = estimate(request);
    UploadShare upload = uploads_.take(request.connection, need);
    Reservation reservation = reserve(need, resident);
    queue_.check_room(request.layout.total_bytes());
    Attendance attendance;
    attendance.stream = reservation.split({stream_bytes(config_), 0});
    const std::int64_t sequence = next_sequence_++;
    attendance.job = std::make_shared<Job>(
        "jobs/" + instance_ + "-" + std::to_string(sequence), sequence, request,
        std::move(reservation), array_bytes(request.layout.coordinates_bytes), std::move(upload),
        staging_.get(), [this](const Job& ended) { retire(ended); });
    attendance.watcher = attendance.job->watch(observer).value();
    if (!store_.add(attendance.job)) continue;
    // A drain that began meanwhile may have looked at the store before this job
    // was in it.
    if (draining()) {
      attendance.job->end(draining_error());
      std::rethrow_exception(draining_error());
    }
    return attendance;
  }
}

Reservation Engine::reserve(MemoryEstimate need, const std::vector<int>& preferred_devices) {
  for (;;) {
    try {
      return ledger_.reserve(need, preferred_devices);
    } catch (const OutOfMemory& error) {
      if (error.reason() == "MESH_TOO_LARGE" || !topologies_.evict_one()) throw;
    }
  }
}

std::optional<Attendance> Engine::join(const JobRequest& request, const Job::Observer& observer) {
  const auto job = store_.find_request(request.identity, request.request_id);
  if (!job || !job->joinable()) return std::nullopt;
  if (const std::string field = differing_field(job->request().fields, request.fields);
      !field.empty()) {
    throw Error("REQUEST_ID_REUSED",
                "request_id " + request.request_id + " is that of " + job->name() + ", whose " +
                    field + " is another; take a new id for a new job",
                {{"field", field}, {"name", job->name()}});
  }
  Attendance attendance{job, 0, true, reserve({stream_bytes(config_), 0})};
  const auto watcher = job->watch(observer);
  if (!watcher) return std::nullopt;
  attendance.watcher = *watcher;
  return attendance;
}

Attendance Engine::attend(const std::shared_ptr<Job>& job, const Job::Observer& observer) {
  Attendance attendance{job, 0, true, reserve({stream_bytes(config_), 0})};
  if (const auto watcher = job->watch(observer)) {
    attendance.watcher = *watcher;
    return attendance;
  }
  if (const std::exception_ptr cause = job->stop_cause()) std::rethrow_exception(cause);
  if (const std::exception_ptr error = job->snapshot().error) std::rethrow_exception(error);
  throw Error("RESULT_NOT_KEPT", job->name() + " has ended; its result is not kept (any more)",
              {{"name", job->name()}});
}

void Engine::leave(Attendance& attendance, const std::exception_ptr& cause) {
  if (!attendance.job) return;
  const std::shared_ptr<Job> job = std::move(attendance.job);
  const bool brings_mesh = !attendance.joined && job->state() == JobState::receiving;
  const bool last = job->leave(attendance.watcher, cause);
  if (brings_mesh || (last && job->state() == JobState::sending)) {
    job->end(cause);
  } else if (last) {
    end_waiting(*job, cause);
  }
  attendance.stream = {};
}

void Engine::forget(Job& job) {
  while (!store_.forget(job)) {
    if (!has_ended(job.state())) {
      throw Error("JOB_NOT_FINISHED", job.name() + " has not ended; cancel it first",
                  {{"name", job.name()}});
    }
    // Another call was faster; or the store is just being told that the job has ended.
    if (!store_.find(job.request().identity, job.name())) break;
    std::this_thread::yield();
  }
  results_.drop(job);
}

void Engine::submit(const std::shared_ptr<Job>& job) {
  const wire::MeshLayout& layout = job->request().layout;
  job->keep_topology(topologies_, array_bytes(layout) - array_bytes(layout.coordinates_bytes));
  job->queue(queue_.take_place(layout.total_bytes()));
  queue_.push(job, job->request().priority);
  // A stop that came before the push did not find the job in the queue.
  if (job->stop_cause()) end_waiting(*job, job->stop_cause());
}

void Engine::complete(Job& job) { job.end(); }

void Engine::cancel(Job& job, std::exception_ptr cause) {
  if (job.request_stop(cause)) end_waiting(job, cause);
}

void Engine::end_waiting(Job& job, std::exception_ptr cause) {
  if (queue_.remove(job)) job.end(cause);
}

void Engine::call_ended() {
  --calls_;
  wake();
}

void Engine::retire(const Job& job) {
  if (job.request().kept() && job.snapshot().result)
    results_.keep(store_.find(job.request().identity, job.name()));
  for (const auto& forgotten : store_.retire(job)) results_.drop(*forgotten);
  metrics_.job_ended(job);
  log_job_end(job);
  wake();
}

void Engine::hand_back_waiting() {
  for (const auto& job : store_.living()) {
    const std::exception_ptr cause = draining_error();
    if (job->hand_back(cause)) end_waiting(*job, cause);
  }
}

void Engine::stop_all() {
  for (const auto& job : store_.living()) cancel(*job, draining_error());
}

void Engine::close() {
  queue_.close();
  for (const auto& lane : lanes_) lane->join();
}

void Engine::keep_house(const std::stop_token& stop) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  const auto patience = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(config_.lane_watchdog_seconds));
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  while (!stopped.wait_for(lock, stop, kInterval, [] { return false; }) && !stop.stop_requested()) {
    const auto now = Clock::now();
    results_.expire(now);
    for (const auto& lane : lanes_) lane->watch(now, patience);
    for (const auto& job : store_.living()) {
      if (job->waited_too_long(now)) end_waiting(*job, queue_timeout_error());
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
