#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "smooth/cuda/device/stream.hpp"
#include "smooth/cuda/device/suballocator.hpp"
#include "smooth/steps/byte_count.hpp"

namespace meshsmooth::detail {

/// The device memory of one lane, in the order of its stream: what is freed may be used by what
/// is queued later. Small buffers lie in a slab of the lane's own, for a call of the driver costs
/// 1 us, and more beside other lanes, whose calls wait for each other (3.5 us with eight on an
/// H200, and 30 of them a job). All others come from a pool of the driver's, which keeps what is
/// freed for the next job, at rest up to the release threshold. For one thread.
class DevicePool {
 public:
  /// slab_bytes: 0 leaves every buffer to the driver, so that its tools see where it ends.
  DevicePool(const Stream& stream, int device, std::size_t release_threshold,
             std::size_t slab_bytes)
      : stream_(stream.get()), slab_size_(slab_bytes), slab_(slab_bytes) {
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location = {cudaMemLocationTypeDevice, device};
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "making a memory pool");
    std::uint64_t threshold = release_threshold;
    check_cuda(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &threshold),
               "setting a memory pool's threshold");
    if (slab_bytes > 0) slab_data_ = static_cast<std::byte*>(allocate_from_driver(slab_bytes));
  }
  ~DevicePool() {
    if (slab_data_ != nullptr) cudaFreeAsync(slab_data_, stream_);
    cudaMemPoolDestroy(pool_);
  }
  DevicePool(const DevicePool&) = delete;
  DevicePool& operator=(const DevicePool&) = delete;

  [[nodiscard]] cudaMemPool_t get() const { return pool_; }

  /// Uninitialised.
  /// throws  OutOfMemory
  [[nodiscard]] void* allocate(std::size_t bytes) {
    // What is large would push many others out, and its call is a small part of its job.
    const std::size_t offset = bytes <= slab_size_ / 4 ? slab_.take(bytes) : Slab::kFull;
    return offset == Slab::kFull ? allocate_from_driver(bytes) : slab_data_ + offset;
  }
  void release(void* data, std::size_t bytes) noexcept {
    auto* const place = static_cast<std::byte*>(data);
    if (slab_data_ != nullptr && place >= slab_data_ && place < slab_data_ + slab_size_) {
      slab_.give(static_cast<std::size_t>(place - slab_data_), bytes);
    } else {
      cudaFreeAsync(data, stream_);
    }
  }

 private:
  void* allocate_from_driver(std::size_t bytes) {
    void* data = nullptr;
    const cudaError_t result = cudaMallocFromPoolAsync(&data, bytes, pool_, stream_);
    if (result == cudaErrorMemoryAllocation) {
      static_cast<void>(cudaGetLastError());
      throw OutOfMemory("DEVICE_MEMORY_EXHAUSTED",
                        "device memory: " + std::to_string(bytes) +
                            " bytes more could not be allocated; use a smaller mesh");
    }
    check_cuda(result, "allocating device memory");
    return data;
  }

  cudaStream_t stream_;
  cudaMemPool_t pool_ = nullptr;
  std::byte* slab_data_ = nullptr;
  std::size_t slab_size_;
  Slab slab_;
};

/// Where a job's device memory comes from.
struct DeviceMemory {
  DevicePool& pool;
  ByteCount& count;
};

/// Owns uninitialised device memory that is valid in the order of its stream:
/// other streams must wait for it, and it must outlive their work. Moves, never
/// copies.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(std::size_t size, const DeviceMemory& memory)
      : size_(size), pool_(&memory.pool), count_(&memory.count) {
    if (size == 0) return;
    data_ = static_cast<T*>(pool_->allocate(size * sizeof(T)));
    count_->add(size * sizeof(T));
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    DeviceBuffer moved(std::move(other));
    swap(moved);
    return *this;
  }
  ~DeviceBuffer() {
    if (data_ == nullptr) return;
    count_->subtract(size_ * sizeof(T));
    pool_->release(data_, size_ * sizeof(T));
  }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(pool_, other.pool_);
    std::swap(count_, other.count_);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  DevicePool* pool_ = nullptr;
  ByteCount* count_ = nullptr;
};

/// Owns host memory that device and host both see. Small: for what a kernel
/// tells the host.
template <class T>
class MappedBuffer {
 public:
  explicit MappedBuffer(std::size_t size) {
    void* data = nullptr;
    check_cuda(cudaHostAlloc(&data, size * sizeof(T), cudaHostAllocMapped), "pinning host memory");
    data_ = static_cast<T*>(data);
  }
  ~MappedBuffer() { cudaFreeHost(data_); }
  MappedBuffer(const MappedBuffer&) = delete;
  MappedBuffer& operator=(const MappedBuffer&) = delete;

  [[nodiscard]] T* data() const { return data_; }

 private:
  T* data_ = nullptr;
};

}  // namespace meshsmooth::detail
