#pragma once

#include <atomic>
#include <cstddef>

namespace meshsmooth::detail {

/// Counts the bytes of one job: current and peak. Thread-safe.
class ByteCount {
 public:
  void add(std::size_t bytes) {
    const std::size_t now = now_.fetch_add(bytes) + bytes;
    std::size_t peak = peak_.load();
    while (peak < now && !peak_.compare_exchange_weak(peak, now)) {
    }
  }
  void subtract(std::size_t bytes) { now_ -= bytes; }
  [[nodiscard]] std::size_t now() const { return now_; }
  [[nodiscard]] std::size_t peak() const { return peak_; }

 private:
  std::atomic<std::size_t> now_ = 0;
  std::atomic<std::size_t> peak_ = 0;
};

}  // namespace meshsmooth::detail
