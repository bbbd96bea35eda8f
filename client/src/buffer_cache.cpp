#include "buffer_cache.hpp"

#include <algorithm>
#include <iterator>
#include <new>
#include <utility>
#include <variant>

namespace meshsmooth::client {
namespace {

std::size_t bytes_of(const Positions& memory) {
  return std::visit(
      [](const auto& positions) { return positions.capacity() * sizeof(positions[0]); }, memory);
}

}  // namespace

Positions BufferCache::take(const Mesh& mesh) {
  const std::size_t least = mesh.node_count();
  const auto fits = [&](const Positions& memory) {
    if (memory.index() != mesh.positions.index()) return false;
    const std::size_t room =
        std::visit([](const auto& positions) { return positions.capacity(); }, memory);
    return room >= least && room <= least + least / 4;
  };
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(blocks_.rbegin(), blocks_.rend(), fits);
  if (found == blocks_.rend()) return {};
  Positions memory = std::move(*found);
  blocks_.erase(std::next(found).base());
  bytes_ -= bytes_of(memory);
  return memory;
}

void BufferCache::keep(Positions memory) noexcept {
  const std::size_t bytes = bytes_of(memory);
  if (bytes < kLeastBytes || bytes > kMostBytes) return;
  std::deque<Positions> evicted;  // freed outside the lock
  try {
    const std::lock_guard lock(mutex_);
    while (bytes_ + bytes > kMostBytes) {
      evicted.push_back(std::move(blocks_.front()));
      blocks_.pop_front();
      bytes_ -= bytes_of(evicted.back());
    }
    blocks_.push_back(std::move(memory));
    bytes_ += bytes;
  } catch (const std::bad_alloc&) {  // then it is not kept
  }
}

}  // namespace meshsmooth::client
