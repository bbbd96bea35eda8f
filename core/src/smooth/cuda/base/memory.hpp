#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "smooth/base/byte_count.hpp"
#include "smooth/cuda/base/stream.hpp"
#include "smooth/cuda/base/suballocator.hpp"

namespace meshsmooth::detail {

/// The device memory of one lane, ordered by its stream: what is freed may be used by work queued
/// later. Small buffers come from an arena: a driver call costs 1 us, or 3.5 us with eight
/// lanes, whose calls serialize (30 of them a job, H200). All others come from a pool of the
/// driver's, which keeps freed memory for the next job, up to the release threshold. Not
/// thread-safe.
class DevicePool {
 public:
  /// arena_bytes: 0 leaves every buffer to the driver, so that its tools see the bounds.
  DevicePool(const Stream& stream, int device, std::size_t release_threshold,
             std::size_t arena_bytes)
      : stream_(stream.get()), arena_size_(arena_bytes), arena_(arena_bytes) {
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location = {cudaMemLocationTypeDevice, device};
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "creating a memory pool");
    std::uint64_t threshold = release_threshold;
    check_cuda(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &threshold),
               "setting a memory pool's threshold");
    if (arena_bytes > 0) arena_data_ = static_cast<std::byte*>(allocate_from_driver(arena_bytes));
  }
  ~DevicePool() {
    if (arena_data_ != nullptr) cudaFreeAsync(arena_data_, stream_);
    cudaMemPoolDestroy(pool_);
  }
  DevicePool(const DevicePool&) = delete;
  DevicePool& operator=(const DevicePool&) = delete;

  [[nodiscard]] cudaMemPool_t get() const { return pool_; }

  /// Uninitialized memory. Throws OutOfMemory.
  [[nodiscard]] void* allocate(std::size_t bytes) {
    // A large buffer would displace many small ones, and its driver call is a small part of a job.
    const std::size_t offset =
        bytes <= arena_size_ / 4 ? arena_.allocate(bytes) : Suballocator::kFull;
    return offset == Suballocator::kFull ? allocate_from_driver(bytes) : arena_data_ + offset;
  }
  void release(void* data, std::size_t bytes) noexcept {
    auto* const begin = static_cast<std::byte*>(data);
    if (arena_data_ != nullptr && begin >= arena_data_ && begin < arena_data_ + arena_size_) {
      arena_.release(static_cast<std::size_t>(begin - arena_data_), bytes);
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
                            " more bytes could not be allocated; use a smaller mesh");
    }
    check_cuda(result, "allocating device memory");
    return data;
  }

  cudaStream_t stream_;
  cudaMemPool_t pool_ = nullptr;
  std::byte* arena_data_ = nullptr;
  std::size_t arena_size_;
  Suballocator arena_;
};

/// The source of a job's device memory, and its byte count.
struct DeviceMemory {
  DevicePool& pool;
  ByteCount& count;
};

/// Owns uninitialized device memory, valid in the order of its stream: other streams must wait for
/// it, and it must outlive their work. Move-only.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(std::size_t size, const DeviceMemory& memory) {
    if (size == 0) return;
    data_ = {static_cast<T*>(memory.pool.allocate(size * sizeof(T))),
             Release{size, &memory.pool, &memory.count}};
    memory.count.add(size * sizeof(T));
  }

  /// The same memory, owned by this buffer, which must outlive that one.
  [[nodiscard]] DeviceBuffer borrow() const {
    DeviceBuffer borrowed;
    borrowed.data_ = {data_.get(), Release{size()}};
    return borrowed;
  }

  [[nodiscard]] T* data() { return data_.get(); }
  [[nodiscard]] const T* data() const { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return data_ ? data_.get_deleter().size : 0; }

 private:
  struct Release {
    std::size_t size = 0;
    DevicePool* pool = nullptr;  // null: borrowed
    ByteCount* count = nullptr;

    void operator()(T* data) const noexcept {
      if (pool == nullptr) return;
      count->subtract(size * sizeof(T));
      pool->release(data, size * sizeof(T));
    }
  };

  std::unique_ptr<T, Release> data_;
};

/// Owns page-locked host memory mapped into the device's address space.
template <class T>
class MappedBuffer {
 public:
  explicit MappedBuffer(std::size_t size) {
    void* data = nullptr;
    check_cuda(cudaHostAlloc(&data, size * sizeof(T), cudaHostAllocMapped),
               "allocating page-locked memory");
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
