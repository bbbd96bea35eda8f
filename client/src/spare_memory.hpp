#pragma once

#include <cstddef>
#include <deque>
#include <mutex>

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
  /// kLeastBytes are not worth it: malloc has them at hand.
  void keep(Positions memory);

  static constexpr std::size_t kMostBytes = 256 << 20, kLeastBytes = 1 << 20;

 private:
  std::mutex mutex_;
  std::deque<Positions> blocks_;  // the newest last
  std::size_t bytes_ = 0;
};

}  // namespace meshsmooth::client
