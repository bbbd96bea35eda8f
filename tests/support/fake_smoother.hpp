#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::testing {

/// How all fake smoothers of one server behave, and what they did. Thread-safe.
class FakeControl {
 public:
  /// From now on jobs stop before they finish, until `release`.
  void hold() {
    const std::lock_guard lock(mutex_);
    held_ = true;
  }
  /// The same, and they do not hear that they should end.
  void hold_deaf() {
    const std::lock_guard lock(mutex_);
    held_ = deaf_ = true;
  }
  void release() {
    {
      const std::lock_guard lock(mutex_);
      held_ = deaf_ = preparation_held_ = false;
    }
    changed_.notify_all();
  }
  /// Thrown by every job instead of finishing.
  void fail_with(std::function<void()> thrower) {
    const std::lock_guard lock(mutex_);
    thrower_ = std::move(thrower);
  }
  /// The same for the preparation of topologies.
  void hold_preparation() {
    const std::lock_guard lock(mutex_);
    preparation_held_ = true;
  }
  void fail_to_prepare(std::function<void()> thrower) {
    const std::lock_guard lock(mutex_);
    preparation_thrower_ = std::move(thrower);
  }
  /// What each preparation holds.
  void set_prepared_bytes(MemoryEstimate bytes) {
    const std::lock_guard lock(mutex_);
    prepared_bytes_ = bytes;
  }
  /// How many topologies were prepared, or were to be.
  [[nodiscard]] int prepared() const {
    const std::lock_guard lock(mutex_);
    return prepared_;
  }
  /// Progress that a job reports at its start, iterations 1..count.
  void report_progress(int count) { progress_count_ = count; }
  /// Bytes beyond the estimate, that each job asks for at its start.
  void need_more(std::int64_t host_bytes) { extra_bytes_ = host_bytes; }
  /// As a device does, at the end of a job.
  void read_positions_once() { reads_positions_once_ = true; }
  void set_estimate(MemoryEstimate estimate) {
    const std::lock_guard lock(mutex_);
    estimate_ = estimate;
  }
  void set_device_space(DeviceSpace space) {
    const std::lock_guard lock(mutex_);
    device_space_ = space;
  }

  /// Waits until `count` jobs have started in all.
  void wait_started(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return started_ >= count; });
  }
  /// The regions that the last job came with.
  [[nodiscard]] std::vector<std::int32_t> regions() const {
    const std::lock_guard lock(mutex_);
    return regions_;
  }
  /// The pairs of nodes that the last job came with.
  [[nodiscard]] std::vector<NodePair> node_pairs() const {
    const std::lock_guard lock(mutex_);
    return node_pairs_;
  }
  /// The reference that the last job came with, and whether it was in float64.
  [[nodiscard]] std::pair<std::vector<Vec3d>, bool> reference() const {
    const std::lock_guard lock(mutex_);
    return reference_;
  }
  /// The nodes that the last job prescribed, and the positions that it came with.
  [[nodiscard]] std::pair<std::vector<NodeId>, std::vector<Vec3d>> motion() const {
    const std::lock_guard lock(mutex_);
    return motion_;
  }
  [[nodiscard]] int started() const {
    const std::lock_guard lock(mutex_);
    return started_;
  }

 private:
  friend class FakeSmoother;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool held_ = false;
  bool deaf_ = false;
  bool preparation_held_ = false;
  int prepared_ = 0;
  MemoryEstimate prepared_bytes_;
  std::function<void()> preparation_thrower_;
  int started_ = 0;
  std::vector<std::int32_t> regions_;
  std::vector<NodePair> node_pairs_;
  std::pair<std::vector<Vec3d>, bool> reference_;
  std::pair<std::vector<NodeId>, std::vector<Vec3d>> motion_;
  std::function<void()> thrower_;
  MemoryEstimate estimate_;
  DeviceSpace device_space_;
  std::atomic<int> progress_count_ = 0;
  std::atomic<std::int64_t> extra_bytes_ = 0;
  std::atomic<bool> reads_positions_once_ = false;
};

struct FakePreparedTopology final : PreparedTopology {
  MemoryEstimate held;
  [[nodiscard]] MemoryEstimate bytes() const override { return held; }
};

/// Moves every node that is not fixed by (+1, 0, 0); remembers nothing.
class FakeSmoother final : public Smoother {
 public:
  explicit FakeSmoother(std::shared_ptr<FakeControl> control) : control_(std::move(control)) {}

  [[nodiscard]] std::string_view backend() const override { return "cpu"; }

  [[nodiscard]] DeviceSpace device_space() const override {
    const std::lock_guard lock(control_->mutex_);
    return control_->device_space_;
  }

  [[nodiscard]] bool reads_positions_once(const MeshSize&) const override {
    return control_->reads_positions_once_;
  }

  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    MemoryEstimate estimate;
    {
      const std::lock_guard lock(control_->mutex_);
      estimate = control_->estimate_;
    }
    for (const std::int64_t count : size.element_counts) {
      const std::size_t bytes = options.element_quality_metrics.size() * sizeof(float);
      estimate.host_bytes += count * static_cast<std::int64_t>(bytes);
    }
    return estimate;
  }

  std::shared_ptr<const PreparedTopology> prepare(const TopologyView& topology,
                                                  const JobControl& job,
                                                  const PositionsView&) override {
    std::function<void()> thrower;
    auto result = std::make_shared<FakePreparedTopology>();
    {
      std::unique_lock lock(control_->mutex_);
      ++control_->prepared_;
      result->held = control_->prepared_bytes_;
      while (control_->preparation_held_) {
        if (job.stop.stop_requested()) throw Cancelled("CANCELLED", "the job was cancelled");
        control_->changed_.wait_for(lock, std::chrono::milliseconds(1));
      }
      thrower = control_->preparation_thrower_;
    }
    if (thrower) thrower();
    result->topology = topology;
    return result;
  }

  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& job) override {
    if (control_->extra_bytes_ > 0) job.on_extra_memory(control_->extra_bytes_);
    start();
    for (int i = 1; i <= control_->progress_count_; ++i) {
      job.on_progress({.stage = Stage::iterate,
                       .iteration = i,
                       .max_displacement = 1.0 / i,
                       .rms_displacement = 0.5 / i});
    }
    const bool early = wait(job);
    const PositionsSpan& result = positions.result;
    begin_at(positions.given, result);
    std::function<void()> thrower;
    {
      const std::lock_guard lock(control_->mutex_);
      thrower = control_->thrower_;
      control_->regions_.assign(topology.regions.begin(), topology.regions.end());
      const JobInput& input = positions.input;
      control_->node_pairs_.assign(input.node_pairs.begin(), input.node_pairs.end());
      // What a motion begins at is one too.
      const PositionsView& reference =
          is_motion(options.method) ? positions.given : input.reference;
      control_->reference_ = {{}, reference.index() == 1};
      std::visit(
          [&](auto span) {
            for (const auto& p : span) {
              control_->reference_.first.push_back(vec3_cast<double>(p));
            }
          },
          reference);
      const auto& prescribed = input.prescribed.nodes;
      control_->motion_ = {{prescribed.begin(), prescribed.end()}, {}};
      std::visit(
          [&](auto span) {
            for (const auto& p : span) control_->motion_.second.push_back(vec3_cast<double>(p));
          },
          result);
    }
    if (thrower) thrower();

    SmoothSummary summary;
    summary.stop_reason = early ? StopReason::cancelled_with_result : StopReason::converged;
    summary.backend = "cpu";
    summary.device_name = "fake";
    summary.nodes.total = static_cast<std::int64_t>(topology.node_count);
    if (!early) summary.nodes.moved = move(topology, result);
    summary.element_quality.metrics = options.element_quality_metrics;
    for (const QualityMetric metric : options.element_quality_metrics) {
      for (std::size_t e = 0; e < topology.element_count(); ++e) {
        summary.element_quality.values.push_back(element_quality(metric, e));
      }
    }
    return summary;
  }

  /// What it tells of an element.
  [[nodiscard]] static float element_quality(QualityMetric metric, std::size_t element) {
    return 100 * static_cast<float>(metric) + static_cast<float>(element);
  }

 private:
  static void begin_at(const PositionsView& from, const PositionsSpan& to) {
    std::visit(
        []<class Real>(const auto& given, std::span<Vec3<Real>> positions) {
          std::ranges::transform(given, positions.begin(),
                                 [](const auto& p) { return vec3_cast<Real>(p); });
        },
        from, to);
  }

  void start() {
    {
      const std::lock_guard lock(control_->mutex_);
      ++control_->started_;
    }
    control_->changed_.notify_all();
  }

  // True when asked to finish early; polls that flag as a real smoother does
  // between its sweeps.
  bool wait(const JobControl& job) {
    std::unique_lock lock(control_->mutex_);
    const auto finish_early = [&] { return job.finish_early != nullptr && *job.finish_early; };
    while (control_->held_ && !finish_early()) {
      if (job.stop.stop_requested() && !control_->deaf_) {
        throw Cancelled("CANCELLED", "the job was cancelled");
      }
      if (job.deadline && std::chrono::steady_clock::now() >= *job.deadline) {
        throw DeadlineExceeded("DEADLINE_RUNNING", "the deadline passed");
      }
      control_->changed_.wait_for(lock, std::chrono::milliseconds(1));
    }
    return finish_early();
  }

  static std::int64_t move(const TopologyView& topology, const PositionsSpan& positions) {
    std::int64_t moved = 0;
    std::visit(
        [&](auto nodes) {
          for (std::size_t i = 0; i < nodes.size(); ++i) {
            if (!topology.fixed.empty() && topology.fixed[i] != 0) continue;
            nodes[i].x += 1;
            ++moved;
          }
        },
        positions);
    return moved;
  }

  const std::shared_ptr<FakeControl> control_;
};

}  // namespace meshsmooth::testing
