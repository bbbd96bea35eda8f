#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {
namespace {

/// Meshes are taken and outcomes handed over in their order.
class Outcomes {
 public:
  explicit Outcomes(std::size_t count) : outcomes_(count) {}

  /// Returns the next mesh that no thread has taken; none when all are, or after `close`.
  std::optional<std::size_t> take() {
    const std::scoped_lock lock(mutex_);
    return next_ < outcomes_.size() ? std::optional(next_++) : std::nullopt;
  }
  /// Hands out no more meshes.
  void close() {
    const std::scoped_lock lock(mutex_);
    next_ = outcomes_.size();
  }
  void put(std::size_t index, SmoothOutcome outcome) {
    {
      const std::scoped_lock lock(mutex_);
      outcomes_[index] = std::move(outcome);
    }
    ended_.notify_one();
  }
  /// Waits for the outcome of a mesh.
  SmoothOutcome wait_for(std::size_t index) {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [&] { return outcomes_[index].has_value(); });
    return *std::exchange(outcomes_[index], std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  std::size_t next_ = 0;
  std::vector<std::optional<SmoothOutcome>> outcomes_;
};

void check(const RequestOptions& request, int max_in_flight) {
  if (!request.request_id.empty()) {
    throw InvalidOption("OPTION_MISPLACED", "request_id: many jobs cannot have one id",
                        {{"field", "request_id"}});
  }
  if (max_in_flight < 1) {
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        "max_in_flight is " + std::to_string(max_in_flight) + ", it must be 1 or more",
        {{"field", "max_in_flight"}});
  }
}

}  // namespace

void Client::smooth_many(std::span<Mesh> meshes, const SmoothOptions& options,
                         const RequestOptions& request,
                         const std::function<void(std::size_t, SmoothOutcome)>& on_end,
                         int max_in_flight) {
  check(request, max_in_flight);
  Outcomes outcomes(meshes.size());
  std::stop_source stop;
  const std::stop_callback forward(request.stop, [&stop] { stop.request_stop(); });
  RequestOptions own = request;
  own.stop = stop.get_token();
  const auto work = [&] {
    while (const auto index = outcomes.take()) {
      try {
        outcomes.put(*index, smooth(meshes[*index], options, own));
      } catch (...) {
        outcomes.put(*index, std::current_exception());
      }
    }
  };
  std::vector<std::jthread> threads;  // joined before what they use is destroyed
  try {
    const auto count = std::min(meshes.size(), static_cast<std::size_t>(max_in_flight));
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back(work);
    for (std::size_t i = 0; i < meshes.size(); ++i) on_end(i, outcomes.wait_for(i));
  } catch (...) {
    outcomes.close();
    stop.request_stop();
    throw;
  }
}

}  // namespace meshsmooth::client
