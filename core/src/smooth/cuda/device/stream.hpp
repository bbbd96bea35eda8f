#pragma once

#include <utility>

#include "smooth/cuda/device/check.hpp"

namespace meshsmooth::detail {

/// Owns a stream that does not wait for the default stream. Moves, never copies.
class Stream {
 public:
  Stream() {
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
  }
  ~Stream() {
    if (stream_ != nullptr) cudaStreamDestroy(stream_);
  }
  Stream(Stream&& other) noexcept : stream_(std::exchange(other.stream_, nullptr)) {}
  Stream& operator=(Stream&&) = delete;

  [[nodiscard]] cudaStream_t get() const { return stream_; }
  void synchronize() const { check_cuda(cudaStreamSynchronize(stream_), "waiting for a stream"); }

 private:
  cudaStream_t stream_ = nullptr;
};

/// Owns a point in a stream. Moves, never copies.
class Event {
 public:
  explicit Event(unsigned int flags = cudaEventDefault) {
    check_cuda(cudaEventCreateWithFlags(&event_, flags), "making an event");
  }
  ~Event() {
    if (event_ != nullptr) cudaEventDestroy(event_);
  }
  Event(Event&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
  Event& operator=(Event&&) = delete;

  void record(const Stream& stream) {
    check_cuda(cudaEventRecord(event_, stream.get()), "marking a stream");
  }
  void synchronize() const {
    check_cuda(cudaEventSynchronize(event_), "waiting for a point in a stream");
  }
  /// What comes later in `stream` waits for this event.
  void hold_up(const Stream& stream) const {
    check_cuda(cudaStreamWaitEvent(stream.get(), event_), "ordering two streams");
  }
  /// Both must have been reached.
  [[nodiscard]] double seconds_since(const Event& start) const {
    float milliseconds = 0;
    check_cuda(cudaEventElapsedTime(&milliseconds, start.event_, event_), "reading a time");
    return 1e-3 * static_cast<double>(milliseconds);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace meshsmooth::detail
