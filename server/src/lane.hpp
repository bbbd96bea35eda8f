#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "job.hpp"
#include "job_queue.hpp"
#include "meshsmooth/smoother.hpp"
#include "topology_cache.hpp"

namespace meshsmooth::server {

/// One thread with its own smoother: takes job after job of its device from the queue. Ends
/// when the queue is closed, or when its device is lost; then it says so by
/// `on_broken`, once.
class Lane {
 public:
  Lane(std::unique_ptr<Smoother> smoother, int device, JobQueue& queue, TopologyCache& topologies,
       std::function<void()> on_broken);
  ~Lane() { join(); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Waits for the running job; close the queue before.
  void join();

  [[nodiscard]] const Smoother& smoother() const { return *smoother_; }
  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] bool busy() const;
  /// With jobs, the running one included, since the start.
  [[nodiscard]] double busy_seconds() const;
  [[nodiscard]] bool broken() const { return broken_; }

  /// Breaks a lane whose job was asked to stop longer ago than `patience` and goes on:
  /// nothing less than the end of the process gets its thread back.
  void watch(Clock::time_point now, Clock::duration patience);

 private:
  void run();
  void run_job(Job& job);
  void set_job(std::shared_ptr<Job> job);
  void break_down();
  [[nodiscard]] SmoothSummary smooth(Job& job, const JobControl& control);

  const std::unique_ptr<Smoother> smoother_;
  const int device_;
  JobQueue& queue_;
  TopologyCache& topologies_;
  const std::function<void()> on_broken_;
  std::atomic<bool> broken_ = false;
  std::atomic<bool> told_ = false;  // that it is broken
  mutable std::mutex mutex_;
  std::shared_ptr<Job> job_;  // that runs
  std::optional<Clock::time_point> busy_since_;
  Clock::duration busy_before_{};
  std::thread thread_;
};

}  // namespace meshsmooth::server
