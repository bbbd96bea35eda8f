#pragma once

#include <atomic>
#include <exception>
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

/// What a lane reports, from its own thread. The job is over for the lane then.
struct LaneEvents {
  std::function<void(Job&, SmoothSummary)> finished;     // smoothed, or stopped early
  std::function<void(Job&, std::exception_ptr)> failed;  // why it must end
  std::function<void()> broken;                          // the device is lost; once
};

/// One thread with its own smoother: takes job after job of its device from the queue. Ends
/// when the queue is closed, or when its device is lost. Thread-safe.
class Lane {
 public:
  Lane(std::unique_ptr<Smoother> smoother, int device, JobQueue& queue, TopologyCache& topologies,
       LaneEvents events);
  ~Lane() { join(); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Waits for the running job; close the queue first.
  void join();

  [[nodiscard]] const Smoother& smoother() const { return *smoother_; }
  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] bool busy() const;
  /// Time spent on jobs since the start, including the running one.
  [[nodiscard]] double busy_seconds() const;
  [[nodiscard]] bool broken() const { return broken_; }

  /// Marks the lane as broken when its job was asked to stop longer than `patience` ago and still
  /// runs: only the end of the process gets its thread back.
  void check_watchdog(Clock::time_point now, Clock::duration patience);

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
  const LaneEvents events_;
  std::atomic<bool> broken_ = false;
  std::atomic<bool> reported_ = false;  // that it is broken
  mutable std::mutex mutex_;
  std::shared_ptr<Job> job_;  // the running one
  std::optional<Clock::time_point> busy_since_;
  Clock::duration busy_before_{};
  std::thread thread_;
};

}  // namespace meshsmooth::server
