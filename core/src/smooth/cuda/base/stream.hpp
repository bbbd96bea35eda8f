#pragma once

#include <utility>

#include "smooth/cuda/base/check.hpp"

namespace meshsmooth::detail {

/// Owns a stream that does not synchronize with the default stream. Move-only.
class Stream {
 public:
  Stream() {
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream");
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

/// Owns an event: a point in a stream. Move-only.
class Event {
 public:
  explicit Event(unsigned int flags = cudaEventDefault) {
    check_cuda(cudaEventCreateWithFlags(&event_, flags), "creating an event");
  }
  ~Event() {
    if (event_ != nullptr) cudaEventDestroy(event_);
  }
  Event(Event&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
  Event& operator=(Event&&) = delete;

  void record(const Stream& stream) {
    check_cuda(cudaEventRecord(event_, stream.get()), "recording an event");
  }
  void synchronize() const { check_cuda(cudaEventSynchronize(event_), "waiting for an event"); }
  /// Later work in `stream` waits for this event.
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
