#pragma once

#include <sys/mman.h>

#include <string>
#include <utility>

#include "meshsmooth/error.hpp"
#include "smooth/steps/byte_count.hpp"

namespace meshsmooth::detail {

/// Memory that returns to the system when freed: an allocator with caches per thread would let a
/// job hold more than its estimate. Null if there is none.
inline void* map_memory(std::size_t bytes) {
  void* const data =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return data == MAP_FAILED ? nullptr : data;
}

/// Owns uninitialised host memory, counted while it lives. Moves, never copies.
template <class T>
class CpuBuffer {
 public:
  CpuBuffer() = default;
  CpuBuffer(std::size_t size, ByteCount& count) : size_(size), count_(&count) {
    if (size == 0) return;
    data_ = static_cast<T*>(map_memory(size * sizeof(T)));
    if (data_ == nullptr) {
      throw OutOfMemory("HOST_MEMORY_EXHAUSTED",
                        "host memory: " + std::to_string(size * sizeof(T)) +
                            " bytes more could not be allocated; use a smaller mesh");
    }
    count_->add(size * sizeof(T));
  }
  CpuBuffer(CpuBuffer&& other) noexcept { swap(other); }
  CpuBuffer& operator=(CpuBuffer&& other) noexcept {
    CpuBuffer moved(std::move(other));
    swap(moved);
    return *this;
  }
  ~CpuBuffer() {
    if (data_ == nullptr || count_ == nullptr) return;
    count_->subtract(size_ * sizeof(T));
    munmap(data_, size_ * sizeof(T));
  }

  /// The same memory, owned by this buffer, which must outlive that one.
  [[nodiscard]] CpuBuffer borrow() const {
    CpuBuffer borrowed;
    borrowed.data_ = data_;
    borrowed.size_ = size_;
    return borrowed;
  }

  /// Moves its bytes to another count.
  void count_by(ByteCount& count) {
    if (data_ != nullptr) {
      count.add(size_ * sizeof(T));
      count_->subtract(size_ * sizeof(T));
    }
    count_ = &count;
  }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  void swap(CpuBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(count_, other.count_);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  ByteCount* count_ = nullptr;  // null: borrowed, or empty
};

}  // namespace meshsmooth::detail
