#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "lane.hpp"
#include "resources.hpp"

namespace meshsmooth::server {

/// The lanes of all devices. One that does not stop its job is taken out of service, and replaced
/// where the device is the host: beside a GPU the kernel that hangs would block the new one too.
/// It returns, or ends if it was replaced, when its job stops after all. Thread-safe.
class LanePool {
 public:
  struct Events {
    LaneEvents of_lanes;  // without `lost`
    /// A device has no lane left in service, for good; by any thread, once a device.
    std::function<void(int device)> device_lost;
  };

  struct Options {
    int lanes;                 // of each device, for any job; the others are for newcomers
    Clock::duration patience;  // time for a job to stop on request
  };

  /// All must outlive it.
  LanePool(std::vector<Resources::Device> devices, MakeSmoother make_smoother, JobQueue& queue,
           TopologyCache& topologies, Options options, Events events);

  /// Finds the lanes that do not stop, or do again. Call it now and then, from one thread.
  void check_watchdog(Clock::time_point now);

  /// Waits for the jobs of the lanes in service; close the queue first.
  void join();

  [[nodiscard]] std::vector<std::shared_ptr<const Lane>> lanes() const;

 private:
  using Lanes = std::vector<std::shared_ptr<Lane>>;

  void add(std::unique_ptr<Smoother> smoother, int device, JobQueue::Takes takes);
  [[nodiscard]] Lanes update_stuck(Clock::time_point now);
  [[nodiscard]] bool may_replace(const Lane& lane) const;
  void take_out(const std::shared_ptr<Lane>& lane);
  void check_device(int device);

  const MakeSmoother make_smoother_;
  JobQueue& queue_;
  TopologyCache& topologies_;
  const Options options_;
  const Events events_;
  const std::size_t lanes_per_device_;
  mutable std::mutex mutex_;
  int next_number_ = 0;
  std::set<int> lost_devices_;
  Lanes lanes_;
};

}  // namespace meshsmooth::server
