#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "smooth/byte_count.hpp"
#include "smooth/cuda/stream.hpp"

namespace meshsmooth::detail {

/// A pool of device memory for one stream. What is freed stays for the next job,
/// at rest up to the release threshold.
class MemoryPool {
 public:
  MemoryPool(int device, std::size_t release_threshold) {
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location = {cudaMemLocationTypeDevice, device};
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "making a memory pool");
    std::uint64_t threshold = release_threshold;
    check_cuda(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &threshold),
               "setting a memory pool's threshold");
  }
  ~MemoryPool() { cudaMemPoolDestroy(pool_); }
  MemoryPool(const MemoryPool&) = delete;
  MemoryPool& operator=(const MemoryPool&) = delete;

  [[nodiscard]] cudaMemPool_t get() const { return pool_; }

 private:
  cudaMemPool_t pool_ = nullptr;
};

/// Where a job's device memory comes from.
struct DeviceMemory {
  const Stream& stream;
  const MemoryPool& pool;
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
      : size_(size), stream_(memory.stream.get()), count_(&memory.count) {
    if (size == 0) return;
    void* data = nullptr;
    const cudaError_t result =
        cudaMallocFromPoolAsync(&data, size * sizeof(T), memory.pool.get(), stream_);
    if (result == cudaErrorMemoryAllocation) {
      static_cast<void>(cudaGetLastError());
      throw OutOfMemory("DEVICE_MEMORY_EXHAUSTED",
                        "device memory: " + std::to_string(size * sizeof(T)) +
                            " bytes more could not be allocated; use a smaller mesh");
    }
    check_cuda(result, "allocating device memory");
    data_ = static_cast<T*>(data);
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
    cudaFreeAsync(data_, stream_);
  }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(stream_, other.stream_);
    std::swap(count_, other.count_);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  cudaStream_t stream_ = nullptr;
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
