#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "job.hpp"
#include "job_queue.hpp"
#include "meshsmooth/smoother.hpp"
#include "topology_cache.hpp"

namespace meshsmooth::server {

/// One thread with its own smoother: takes job after job from the queue. Ends
/// when the queue is closed, or when its device is lost; then it says so by
/// `on_broken`, once, from its own thread.
class Lane {
 public:
  Lane(std::unique_ptr<Smoother> smoother, JobQueue& queue, TopologyCache& topologies,
       std::function<void()> on_broken);
  ~Lane() { join(); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Waits for the running job; close the queue before.
  void join();

  [[nodiscard]] const Smoother& smoother() const { return *smoother_; }
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] bool broken() const { return broken_; }

 private:
  void run();
  void run_job(Job& job);
  [[nodiscard]] SmoothSummary smooth(Job& job, const JobControl& control);

  const std::unique_ptr<Smoother> smoother_;
  JobQueue& queue_;
  TopologyCache& topologies_;
  const std::function<void()> on_broken_;
  std::atomic<bool> busy_ = false;
  std::atomic<bool> broken_ = false;
  std::thread thread_;
};

}  // namespace meshsmooth::server
