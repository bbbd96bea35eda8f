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

namespace meshsmooth::server {

/// One thread with its own smoother: takes job after job from the queue. Ends
/// when the queue is closed, or when its device is lost; then it says so by
/// `on_broken`, once, from its own thread.
class Lane {
 public:
  Lane(std::unique_ptr<Smoother> smoother, JobQueue& queue, std::function<void()> on_broken);
  ~Lane() { join(); }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  /// Waits for the running job; close the queue before.
  void join();

  [[nodiscard]] const Smoother& smoother() const { return *smoother_; }
  [[nodiscard]] bool busy() const;
  /// With jobs, the running one included, since the start.
  [[nodiscard]] double busy_seconds() const;
  [[nodiscard]] bool broken() const { return broken_; }

 private:
  void run();
  void run_job(Job& job);
  void set_busy(bool busy);

  const std::unique_ptr<Smoother> smoother_;
  JobQueue& queue_;
  const std::function<void()> on_broken_;
  std::atomic<bool> broken_ = false;
  mutable std::mutex mutex_;
  std::optional<Clock::time_point> busy_since_;
  Clock::duration busy_before_{};
  std::thread thread_;
};

}  // namespace meshsmooth::server
