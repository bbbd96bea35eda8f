#pragma once

#include <cstddef>
#include <iterator>
#include <limits>
#include <map>

namespace meshsmooth::detail {

/// Which stretches of one piece of memory are taken. Knows offsets only, whatever the memory is;
/// for one thread. Stretches are whole units, taken where the first fit is: buffers come and go
/// in much the same order, so that little is left between them.
class Slab {
 public:
  static constexpr std::size_t kUnit = 256;  // as aligned as the driver's own
  static constexpr std::size_t kFull = std::numeric_limits<std::size_t>::max();

  explicit Slab(std::size_t capacity) {
    if (capacity >= kUnit) free_.emplace(0, capacity / kUnit * kUnit);
  }

  /// The offset of `size` bytes, or kFull. O(free stretches).
  [[nodiscard]] std::size_t take(std::size_t size) {
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

  /// Takes back what `take(size)` gave. O(log(free stretches)).
  void give(std::size_t offset, std::size_t size) {
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

  /// Stretches that are free, none of which touches another.
  [[nodiscard]] std::size_t free_stretches() const { return free_.size(); }

 private:
  static std::size_t rounded_up(std::size_t size) {
    return size <= kUnit ? kUnit : (size + kUnit - 1) / kUnit * kUnit;
  }

  std::map<std::size_t, std::size_t> free_;  // size by offset
};

}  // namespace meshsmooth::detail
