#include "engine.hpp"

#include <algorithm>
#include <random>
#include <thread>
#include <utility>

#include "log.hpp"
#include "memory_limit.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

ServerConfig filled_in(ServerConfig config) {
  if (config.threads_per_lane == 0) {
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    config.threads_per_lane = std::max(1, cores / config.lanes);
  }
  if (config.host_memory_limit_bytes == 0) {
    config.host_memory_limit_bytes = available_host_bytes() / 10 * 8;
  }
  if (config.max_job_bytes == 0) config.max_job_bytes = config.host_memory_limit_bytes;
  if (config.max_queued_bytes == 0) config.max_queued_bytes = config.host_memory_limit_bytes;
  return config;
}

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

}  // namespace

std::exception_ptr draining_error() {
  return std::make_exception_ptr(
      Error("DRAINING", "this server is shutting down; send the job to another one"));
}

Engine::Engine(ServerConfig config, const SmootherFactory& factory,
               std::function<void()> on_lane_broken)
    : config_(filled_in(std::move(config))),
      instance_(random_instance()),
      ledger_({.host_bytes = config_.host_memory_limit_bytes, .device_bytes = INT64_MAX}),
      queue_(config_.max_queued_jobs, config_.max_queued_bytes),
      store_(static_cast<std::size_t>(config_.max_kept_jobs)) {
  std::vector<std::unique_ptr<Smoother>> smoothers;
  for (int lane = 0; lane < config_.lanes; ++lane) {
    smoothers.push_back(factory ? factory()
                                : make_smoother(config_.backend, config_.threads_per_lane));
  }
  for (auto& smoother : smoothers) {
    lanes_.push_back(std::make_unique<Lane>(std::move(smoother), queue_, on_lane_broken));
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

MemoryEstimate Engine::estimate(const JobRequest& request) const {
  const MemoryEstimate own =
      lanes_.front()->smoother().estimate(request.layout.size(), request.options);
  const MemoryEstimate need{
      .host_bytes = request.layout.total_bytes() + own.host_bytes + stream_bytes(config_),
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

std::shared_ptr<Job> Engine::admit(JobRequest request, Job::Observer observer) {
  if (draining()) std::rethrow_exception(draining_error());
  Reservation reservation = ledger_.reserve(estimate(request));
  QueuePlace place = queue_.admit(request.layout.total_bytes());
  const std::int64_t sequence = next_sequence_++;
  auto job = std::make_shared<Job>(
      "jobs/" + instance_ + "-" + std::to_string(sequence), sequence, std::move(request),
      std::move(reservation), std::move(place), [this](const Job& ended) { retire(ended); },
      std::move(observer));
  store_.add(job);
  // A drain that began meanwhile may have looked at the store before this job
  // was in it.
  if (draining()) {
    job->end(draining_error());
    std::rethrow_exception(draining_error());
  }
  return job;
}

void Engine::submit(const std::shared_ptr<Job>& job) {
  job->queue();
  queue_.push(job, job->request().priority);
  // A stop that came before the push did not find the job in the queue.
  if (job->stop_cause() && queue_.remove(*job)) job->end(job->stop_cause());
}

void Engine::cancel(Job& job, std::exception_ptr cause) {
  if (job.request_stop(cause) && queue_.remove(job)) job.end(cause);
}

void Engine::expire(Job& job, std::exception_ptr cause) {
  if (queue_.remove(job)) job.end(cause);
}

void Engine::call_ended() {
  --calls_;
  wake();
}

void Engine::retire(const Job& job) {
  store_.retire(job);
  log_job_end(job);
  wake();
}

void Engine::hand_back_waiting() {
  for (const auto& job : store_.living()) {
    const JobState state = job->state();
    if (state == JobState::receiving || state == JobState::queued) cancel(*job, draining_error());
  }
}

void Engine::stop_all() {
  for (const auto& job : store_.living()) cancel(*job, draining_error());
}

void Engine::close() {
  queue_.close();
  for (const auto& lane : lanes_) lane->join();
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
