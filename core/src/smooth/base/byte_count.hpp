#pragma once

#include <array>
#include <atomic>
#include <cstddef>

#include "smooth/plan/memory_plan.hpp"

namespace meshsmooth::detail {

/// Counts the bytes of one job: current and peak, in all and by its stages. Thread-safe.
class ByteCount {
 public:
  /// What is held and allocated from now on belongs to this stage.
  void enter(JobStage stage) {
    stage_ = stage;
    raise(peaks_[index(stage)], now_);
  }

  void add(std::size_t bytes) {
    const std::size_t now = now_.fetch_add(bytes) + bytes;
    raise(peaks_[index(stage_)], now);
    raise(peak_, now);
  }
  void subtract(std::size_t bytes) { now_ -= bytes; }
  [[nodiscard]] std::size_t now() const { return now_; }
  [[nodiscard]] std::size_t peak() const { return peak_; }
  [[nodiscard]] std::size_t peak_of(JobStage stage) const { return peaks_[index(stage)]; }

 private:
  using Bytes = std::atomic<std::size_t>;

  [[nodiscard]] static std::size_t index(JobStage stage) { return static_cast<std::size_t>(stage); }
  static void raise(Bytes& peak, std::size_t now) {
    std::size_t before = peak.load();
    while (before < now && !peak.compare_exchange_weak(before, now)) {
    }
  }

  Bytes now_ = 0;
  Bytes peak_ = 0;
  std::array<Bytes, kJobStageCount> peaks_{};
  std::atomic<JobStage> stage_ = JobStage::none;
};

}  // namespace meshsmooth::detail
