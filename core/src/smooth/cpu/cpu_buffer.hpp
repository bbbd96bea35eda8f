#pragma once

#include <sys/mman.h>

#include <memory>
#include <string>

#include "meshsmooth/error.hpp"
#include "smooth/base/byte_count.hpp"

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
  CpuBuffer(std::size_t size, ByteCount& count) {
    if (size == 0) return;
    data_ = {static_cast<T*>(map_memory(size * sizeof(T))), Release{size, &count}};
    if (!data_) {
      throw OutOfMemory("HOST_MEMORY_EXHAUSTED",
                        "host memory: " + std::to_string(size * sizeof(T)) +
                            " bytes more could not be allocated; use a smaller mesh");
    }
    count.add(size * sizeof(T));
  }

  /// The same memory, owned by this buffer, which must outlive that one.
  [[nodiscard]] CpuBuffer borrow() const {
    CpuBuffer borrowed;
    borrowed.data_ = {data_.get(), Release{size()}};
    return borrowed;
  }

  /// Moves its bytes to another count.
  void count_by(ByteCount& count) {
    if (!data_) return;
    count.add(size() * sizeof(T));
    data_.get_deleter().count->subtract(size() * sizeof(T));
    data_.get_deleter().count = &count;
  }

  [[nodiscard]] T* data() { return data_.get(); }
  [[nodiscard]] const T* data() const { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return data_ ? data_.get_deleter().size : 0; }

 private:
  struct Release {
    std::size_t size = 0;
    ByteCount* count = nullptr;  // null: borrowed

    void operator()(T* data) const noexcept {
      if (count == nullptr) return;
      count->subtract(size * sizeof(T));
      munmap(data, size * sizeof(T));
    }
  };

  std::unique_ptr<T, Release> data_;
};

}  // namespace meshsmooth::detail
