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
  std::function<void()> lost = {};                       // the device is lost; once
};

/// One thread with its own smoother: takes job after job of its device from the queue. Ends
/// when the queue is closed, when its device is lost, or after its job once retired. Thread-safe.
class Lane {
 public:
  struct Place {
    int device;
    int number;  // among all lanes
    JobQueue::Takes takes;
  };

  Lane(std::unique_ptr<Smoother> smoother, Place place, JobQueue& queue, TopologyCache& topologies,
       LaneEvents events);
  ~Lane() { join(); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Waits for the running job; close the queue first.
  void join();

  [[nodiscard]] const Smoother& smoother() const { return *smoother_; }
  [[nodiscard]] int device() const { return place_.device; }
  [[nodiscard]] int number() const { return place_.number; }
  [[nodiscard]] JobQueue::Takes takes() const { return place_.takes; }
  [[nodiscard]] bool busy() const;
  /// Time spent on jobs since the start, including the running one.
  [[nodiscard]] double busy_seconds() const;
  /// Whether it takes jobs: its device is there, and its job stops when asked to.
  [[nodiscard]] bool in_service() const { return !lost_ && !stuck_ && !retired_; }
  /// Whether its job was asked to stop longer than `patience` ago and still runs.
  [[nodiscard]] bool ignores_stop(Clock::time_point now, Clock::duration patience) const;
  /// Returns the former value.
  bool set_stuck(bool stuck) { return stuck_.exchange(stuck); }
  [[nodiscard]] bool stuck() const { return stuck_; }
  /// Takes no more jobs: another lane has its place.
  void retire() { retired_ = true; }
  [[nodiscard]] bool retired() const { return retired_; }
  /// Retired, and its job has ended.
  [[nodiscard]] bool gone() const { return retired_ && ended_; }

 private:
  void run();
  void run_job(Job& job);
  void set_job(std::shared_ptr<Job> job);
  [[nodiscard]] SmoothSummary smooth(Job& job, const JobControl& control);

  const std::unique_ptr<Smoother> smoother_;
  const Place place_;
  JobQueue& queue_;
  TopologyCache& topologies_;
  const LaneEvents events_;
  std::atomic<bool> lost_ = false, stuck_ = false, retired_ = false, ended_ = false;
  std::mutex joining_;
  mutable std::mutex mutex_;
  std::shared_ptr<Job> job_;  // the running one
  std::optional<Clock::time_point> busy_since_;
  Clock::duration busy_before_{};
  std::thread thread_;
};

}  // namespace meshsmooth::server
