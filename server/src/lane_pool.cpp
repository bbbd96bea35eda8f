#include "lane_pool.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "log.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

LanePool::LanePool(std::vector<Resources::Device> devices, MakeSmoother make_smoother,
                   JobQueue& queue, TopologyCache& topologies, Options options, Events events)
    : make_smoother_(std::move(make_smoother)),
      queue_(queue),
      topologies_(topologies),
      options_(options),
      events_(std::move(events)),
      lanes_per_device_(devices.front().smoothers.size()) {
  try {
    for (std::size_t device = 0; device < devices.size(); ++device) {
      int lane = 0;
      for (auto& smoother : devices[device].smoothers) {
        const bool any = lane++ < options_.lanes;
        add(std::move(smoother), static_cast<int>(device),
            any ? JobQueue::Takes::any : JobQueue::Takes::newcomers);
      }
    }
  } catch (...) {  // no memory for another thread: those that wait for jobs are to end
    queue_.close();
    throw;
  }
}

void LanePool::add(std::unique_ptr<Smoother> smoother, int device, JobQueue::Takes takes) {
  LaneEvents events = events_.of_lanes;
  events.lost = [this, device] { check_device(device); };
  const std::lock_guard lock(mutex_);
  lanes_.push_back(std::make_shared<Lane>(std::move(smoother),
                                          Lane::Place{device, next_number_++, takes}, queue_,
                                          topologies_, std::move(events)));
}

void LanePool::check_watchdog(Clock::time_point now) {
  for (const auto& lane : update_stuck(now)) take_out(lane);
}

LanePool::Lanes LanePool::update_stuck(Clock::time_point now) {
  Lanes stuck, ended;  // destroyed, and so joined, without the lock
  const std::lock_guard lock(mutex_);
  std::erase_if(lanes_, [&](const auto& lane) {
    const bool removed =
        lane->gone() && lane->number() != 0;  // the first's smoother also estimates
    if (removed) ended.push_back(lane);
    return removed;
  });
  for (const auto& lane : lanes_) {
    const bool is_stuck = lane->ignores_stop(now, options_.patience);
    if (lane->set_stuck(is_stuck) == is_stuck || lane->retired()) continue;
    if (is_stuck) {
      stuck.push_back(lane);
    } else {
      log_event("lane_released");
    }
  }
  return stuck;
}

void LanePool::take_out(const std::shared_ptr<Lane>& lane) {
  const std::string name = "lane " + std::to_string(lane->number());
  std::string outcome = "out of service until its job stops";
  if (may_replace(*lane)) {
    try {
      add(make_smoother_(lane->device()), lane->device(), lane->takes());
      lane->retire();
      outcome = "replaced";
    } catch (const std::exception& error) {
      outcome += std::string("; no new one: ") + error.what();
    }
  }
  log_error("lane_stuck", name + " does not stop its job: " + outcome);
  check_device(lane->device());
}

// As many lanes may hang as were there at first: each keeps a core busy.
bool LanePool::may_replace(const Lane& lane) const {
  if (lane.smoother().device_space().total_bytes > 0) return false;
  const std::lock_guard lock(mutex_);
  const auto retired = std::ranges::count_if(lanes_, [&](const auto& other) {
    return other->device() == lane.device() && other->retired() && !other->gone();
  });
  return static_cast<std::size_t>(retired) < lanes_per_device_;
}

void LanePool::check_device(int device) {
  {
    const std::lock_guard lock(mutex_);
    const bool works = std::ranges::any_of(
        lanes_, [=](const auto& lane) { return lane->device() == device && lane->in_service(); });
    if (works || !lost_devices_.insert(device).second) return;
  }
  events_.device_lost(device);
}

void LanePool::join() {
  Lanes lanes;
  {
    const std::lock_guard lock(mutex_);
    lanes = lanes_;
  }
  for (const auto& lane : lanes) {
    if (!lane->stuck()) lane->join();
  }
}

std::vector<std::shared_ptr<const Lane>> LanePool::lanes() const {
  std::vector<std::shared_ptr<const Lane>> lanes;
  const std::lock_guard lock(mutex_);
  std::ranges::copy_if(lanes_, std::back_inserter(lanes),
                       [](const auto& lane) { return !lane->gone(); });
  return lanes;
}

}  // namespace meshsmooth::server
