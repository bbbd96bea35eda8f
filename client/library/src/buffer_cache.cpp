#include "buffer_cache.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <new>
#include <utility>
#include <variant>

namespace meshsmooth::client {
namespace {

std::size_t room_bytes(const Positions& memory) {
  return std::visit(
      [](const auto& positions) { return positions.capacity() * sizeof(positions[0]); }, memory);
}

/// Memory that is filled for the first time comes in large pages where the system gives any: small
/// ones cost a good part of a fast transfer. Only advice. Smaller blocks are malloc's to use again.
void advise_large_pages(void* data, std::size_t bytes) {
  constexpr std::size_t kLeast = 4 << 20;
  if (bytes < kLeast) return;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(data) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / page * page;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace

void make_room(Positions& memory, const PositionsView& like) {
  std::visit(
      [&]<class Real>(std::span<const Vec3<Real>> positions) {
        using Own = std::vector<Vec3<Real>>;
        auto* own = std::get_if<Own>(&memory);
        if (own == nullptr) own = &memory.emplace<Own>();
        const bool is_new = own->capacity() < positions.size();
        if (is_new) *own = Own();  // {} would keep what is then copied
        own->reserve(positions.size());
        own->resize(std::min(own->size(), positions.size()));
        if (is_new) advise_large_pages(own->data(), positions.size_bytes());
      },
      like);
}

Positions BufferCache::take(PositionsView like) {
  const std::size_t least = position_count(like);
  const auto fits = [&](const Positions& memory) {
    if (memory.index() != like.index()) return false;
    const std::size_t room =
        std::visit([](const auto& positions) { return positions.capacity(); }, memory);
    return room >= least && room <= least + least / 4;
  };
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(blocks_.rbegin(), blocks_.rend(), fits);
  if (found == blocks_.rend()) return {};
  Positions memory = std::move(*found);
  blocks_.erase(std::next(found).base());
  bytes_ -= room_bytes(memory);
  return memory;
}

void BufferCache::keep(Positions memory) noexcept {
  const std::size_t bytes = room_bytes(memory);
  if (bytes < kLeastBytes || bytes > kMostBytes) return;
  std::deque<Positions> evicted;  // freed outside the lock
  try {
    const std::lock_guard lock(mutex_);
    while (bytes_ + bytes > kMostBytes) {
      evicted.push_back(std::move(blocks_.front()));
      blocks_.pop_front();
      bytes_ -= room_bytes(evicted.back());
    }
    blocks_.push_back(std::move(memory));
    bytes_ += bytes;
  } catch (const std::bad_alloc&) {  // then it is not kept
  }
}

}  // namespace meshsmooth::client
