#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <span>
#include <utility>
#include <variant>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::client {

using Positions = decltype(Mesh::positions);

[[nodiscard]] inline std::span<const std::byte> bytes_of(const PositionsView& positions) {
  return std::visit([](const auto& span) { return std::as_bytes(span); }, positions);
}

/// Has memory hold room for positions like these, and at most as many of any content.
void make_room(Positions& memory, const PositionsView& like);

/// Buffers for the results of later jobs. The kernel hands out large blocks page by page, which
/// takes longer than filling them: a 40 MB result arrives at 1.2 instead of 2.8 GB/s. Thread-safe.
class BufferCache {
 public:
  /// A buffer with the capacity for so many positions of that precision and at most a quarter more,
  /// with any content; an empty one when there is none.
  [[nodiscard]] Positions take(PositionsView like);
  /// Evicts the oldest buffers beyond kMostBytes in all. Buffers below kLeastBytes are not kept:
  /// malloc has such blocks at hand.
  void keep(Positions memory) noexcept;

  static constexpr std::size_t kMostBytes = 64 << 20, kLeastBytes = 1 << 20;

 private:
  std::mutex mutex_;
  std::deque<Positions> blocks_;  // the newest last
  std::size_t bytes_ = 0;
};

/// A buffer for the result of one job; what it holds in the end returns to the cache.
class BorrowedBuffer {
 public:
  BorrowedBuffer(BufferCache& cache, PositionsView like)
      : positions(cache.take(like)), cache_(cache) {}
  ~BorrowedBuffer() { cache_.keep(std::move(positions)); }
  BorrowedBuffer(const BorrowedBuffer&) = delete;
  BorrowedBuffer& operator=(const BorrowedBuffer&) = delete;

  Positions positions;

 private:
  BufferCache& cache_;
};

}  // namespace meshsmooth::client
