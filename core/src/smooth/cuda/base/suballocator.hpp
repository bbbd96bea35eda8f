#pragma once

#include <cstddef>
#include <iterator>
#include <limits>
#include <map>

namespace meshsmooth::detail {

/// First-fit suballocator with coalescing. Knows offsets only, whatever the memory is. Buffers of a
/// job come and go in much the same order, which keeps fragmentation low. Not thread-safe.
class Suballocator {
 public:
  static constexpr std::size_t kAlignment = 256;  // as the driver's allocations
  static constexpr std::size_t kFull = std::numeric_limits<std::size_t>::max();

  explicit Suballocator(std::size_t capacity) {
    if (capacity >= kAlignment) free_.emplace(0, capacity / kAlignment * kAlignment);
  }

  /// The offset of `size` bytes, or kFull. O(free ranges).
  [[nodiscard]] std::size_t allocate(std::size_t size) {
    size = rounded_up(size);
    for (auto at = free_.begin(); at != free_.end(); ++at) {
      const auto [offset, free] = *at;
      if (free < size) continue;
      const auto next = free_.erase(at);
      if (free > size) free_.emplace_hint(next, offset + size, free - size);
      return offset;
    }
    return kFull;
  }

  /// Frees what `allocate(size)` returned. O(log(free ranges)).
  void release(std::size_t offset, std::size_t size) {
    size = rounded_up(size);
    auto next = free_.upper_bound(offset);
    if (next != free_.end() && offset + size == next->first) {
      size += next->second;
      next = free_.erase(next);
    }
    if (next != free_.begin()) {
      const auto before = std::prev(next);
      if (before->first + before->second == offset) {
        before->second += size;
        return;
      }
    }
    free_.emplace_hint(next, offset, size);
  }

  /// Free ranges, no two of which are adjacent.
  [[nodiscard]] std::size_t free_range_count() const { return free_.size(); }

 private:
  static std::size_t rounded_up(std::size_t size) {
    return size <= kAlignment ? kAlignment : (size + kAlignment - 1) / kAlignment * kAlignment;
  }

  std::map<std::size_t, std::size_t> free_;  // size by offset
};

}  // namespace meshsmooth::detail
