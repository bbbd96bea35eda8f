#pragma once

#include <cstddef>
#include <memory>
#include <memory_resource>
#include <span>
#include <utility>

namespace meshsmooth::wire {

/// Bytes of an array, not initialized, aligned to 64; or bytes of somebody else. Moves, never
/// copies.
class ByteArray {
 public:
  ByteArray() = default;
  /// `memory` must outlive it. Throws std::bad_alloc.
  ByteArray(std::size_t size, std::pmr::memory_resource* memory)
      : size_(size), memory_(memory), data_(size == 0 ? nullptr : allocate()) {}
  /// Bytes that are there as long as their owner.
  ByteArray(std::span<std::byte> bytes, std::shared_ptr<void> owner)
      : size_(bytes.size()), data_(bytes.data()), owner_(std::move(owner)) {}
  ByteArray(ByteArray&& other) noexcept { swap(other); }
  ByteArray& operator=(ByteArray&& other) noexcept {
    ByteArray moved(std::move(other));
    swap(moved);
    return *this;
  }
  ~ByteArray() {
    if (memory_ != nullptr && data_ != nullptr) memory_->deallocate(data_, size_, kAlignment);
  }

  [[nodiscard]] std::byte* data() { return data_; }
  [[nodiscard]] const std::byte* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::span<const std::byte> bytes() const { return {data_, size_}; }

 private:
  static constexpr std::size_t kAlignment = 64;

  std::byte* allocate() { return static_cast<std::byte*>(memory_->allocate(size_, kAlignment)); }
  void swap(ByteArray& other) noexcept {
    std::swap(size_, other.size_);
    std::swap(memory_, other.memory_);
    std::swap(data_, other.data_);
    std::swap(owner_, other.owner_);
  }

  std::size_t size_ = 0;
  std::pmr::memory_resource* memory_ = nullptr;  // null: they are its owner's
  std::byte* data_ = nullptr;
  std::shared_ptr<void> owner_;
};

}  // namespace meshsmooth::wire
