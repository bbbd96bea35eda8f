#pragma once

#include <optional>
#include <vector>

#include "meshsmooth/element.hpp"
#include "smooth/cuda/base/memory.hpp"

namespace meshsmooth::detail {

inline constexpr std::size_t kMostDevices = 64;  // of a process

/// What a device offers a cooperative kernel.
struct DeviceLimits {
  int multiprocessors = 0;
  std::size_t shared_bytes = 0;  // dynamic shared memory per block
};

/// What a lane of the CUDA backend owns from job to job. Not thread-safe.
class CudaLane {
 public:
  explicit CudaLane(int device);

  Stream stream;   // kernels, and copies in their order
  Stream uploads;  // copies that need not wait for kernels
  Event ordering{cudaEventDisableTiming};
  std::vector<Event> events;

  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] int multiprocessor_count() const { return limits_.multiprocessors; }
  [[nodiscard]] const DeviceLimits& limits() const { return limits_; }
  [[nodiscard]] DevicePool& pool() { return pool_; }
  [[nodiscard]] const DevicePool& pool() const { return pool_; }
  /// The element table.
  [[nodiscard]] const ElementShape* shapes() const { return shapes_.data(); }
  /// Of `reduce_kernel`.
  [[nodiscard]] unsigned int* ticket() { return ticket_.data(); }

  /// Mapped host memory that kernels write to, laid out by writer.
  template <class T>
  [[nodiscard]] T* mapped(std::size_t offset) const {
    return reinterpret_cast<T*>(mapped_.data() + offset);
  }
  static constexpr std::size_t kMappedBytes = 1U << 16, kResultBytes = 1U << 12;
  static constexpr std::size_t kResultOffset = 0, kStateOffset = kResultBytes,
                               kSweepsOffset = 2 * kResultBytes,
                               kMovedOffset = kMappedBytes - kResultBytes;

  /// Page-locked staging buffer. Copies to pageable memory are staged by the driver and serialize
  /// across lanes. Invalidated by the next call.
  [[nodiscard]] unsigned char* staging(std::size_t bytes);

 private:
  int device_;
  DeviceLimits limits_;
  ByteCount resident_;
  DevicePool pool_;
  DeviceBuffer<ElementShape> shapes_;
  DeviceBuffer<unsigned int> ticket_;
  MappedBuffer<unsigned char> mapped_{kMappedBytes};
  std::optional<MappedBuffer<unsigned char>> staging_;
  std::size_t staging_size_ = 0;
};

}  // namespace meshsmooth::detail
