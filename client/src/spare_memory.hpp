#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::client {

using Positions = decltype(Mesh::positions);

/// Memory for results to come: large blocks come from the kernel page by page, which takes longer
/// than to fill them (40 MB down at 1.2 instead of 2.8 GB/s). Thread-safe.
class SpareMemory {
 public:
  /// Room for positions like the mesh's and hardly more, with anything in it, or nothing.
  [[nodiscard]] Positions take(const Mesh& mesh);
  /// Forgets what it has had longest when it would have more than kMostBytes. Smaller ones than
  /// kLeastBytes are not energy it: malloc has them at hand.
  void keep(Positions memory) noexcept;

  static constexpr std::size_t kMostBytes = 64 << 20, kLeastBytes = 1 << 20;

 private:
  std::mutex mutex_;
  std::deque<Positions> blocks_;  // the newest last
  std::size_t bytes_ = 0;
};

/// Memory for the result of one job; what it holds in the end is kept.
class BorrowedMemory {
 public:
  BorrowedMemory(SpareMemory& spare, const Mesh& mesh) : places(spare.take(mesh)), spare_(spare) {}
  ~BorrowedMemory() { spare_.keep(std::move(places)); }
  BorrowedMemory(const BorrowedMemory&) = delete;
  BorrowedMemory& operator=(const BorrowedMemory&) = delete;

  Positions places;

 private:
  SpareMemory& spare_;
};

}  // namespace meshsmooth::client
