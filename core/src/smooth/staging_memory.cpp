#include "meshsmooth/staging_memory.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>

#include "smooth/cuda/base/suballocator.hpp"
#include "smooth/cuda/smoother.hpp"

namespace meshsmooth {
namespace {

constexpr std::size_t kPageBytes = 4096;

// Smaller blocks are copied about as fast unlocked.
constexpr std::size_t kMinBlockBytes = 8 * kPageBytes;

}  // namespace

/// Locked memory out of which parts are given. Its owner sees to it that one thread at a time does.
class StagingMemory::Ready {
 public:
  explicit Ready(Block memory) : memory_(memory), parts_(memory.bytes) {}

  [[nodiscard]] const Block& memory() const { return memory_; }
  [[nodiscard]] std::size_t free_bytes() const { return memory_.bytes - used_bytes_; }
  [[nodiscard]] bool has(const void* data) const {
    const std::less<> before;
    return !before(data, memory_.data) && before(data, begin() + memory_.bytes);
  }
  /// @returns null when there is no room.
  [[nodiscard]] void* take(std::size_t bytes) {
    const std::size_t offset = parts_.allocate(bytes);
    if (offset == detail::Suballocator::kFull) return nullptr;
    used_bytes_ += bytes;
    return begin() + offset;
  }
  void give_back(void* data, std::size_t bytes) {
    parts_.release(static_cast<std::size_t>(static_cast<std::byte*>(data) - begin()), bytes);
    used_bytes_ -= bytes;
  }

 private:
  [[nodiscard]] std::byte* begin() const { return static_cast<std::byte*>(memory_.data); }

  const Block memory_;
  detail::Suballocator parts_;
  std::size_t used_bytes_ = 0;
};

StagingMemory::StagingMemory(PageLock pages, std::size_t max_idle_bytes,
                             std::pmr::memory_resource* upstream, std::size_t ready_bytes)
    : pages_(std::move(pages)),
      max_idle_bytes_(max_idle_bytes - std::min(max_idle_bytes, ready_bytes)),
      upstream_(upstream) {
  ready_bytes = std::min(ready_bytes, max_idle_bytes) / kPageBytes * kPageBytes;
  if (ready_bytes == 0) return;
  void* const data = upstream_->allocate(ready_bytes, kPageBytes);
  if (pages_.lock(data, ready_bytes)) {
    ready_ = std::make_unique<Ready>(Block{data, ready_bytes});
  } else {
    upstream_->deallocate(data, ready_bytes, kPageBytes);
  }
}

StagingMemory::~StagingMemory() {
  for (const Block& block : idle_) release(block);
  if (ready_) release(ready_->memory());
}

// Eight sizes between successive powers of two; always whole pages.
std::size_t StagingMemory::block_bytes(std::size_t bytes) {
  if (bytes < kMinBlockBytes) return bytes;
  const std::size_t step = std::bit_floor(bytes) / 8;
  return (bytes + step - 1) / step * step;
}

std::size_t StagingMemory::idle_bytes() const {
  const std::lock_guard lock(mutex_);
  return idle_bytes_ + (ready_ ? ready_->free_bytes() : 0);
}

void* StagingMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (bytes < kMinBlockBytes) return upstream_->allocate(bytes, alignment);
  const std::size_t size = block_bytes(bytes);
  if (void* const data = take_idle(size, alignment)) return data;
  void* const data = upstream_->allocate(size, std::max(alignment, kPageBytes));
  if (size > max_idle_bytes_ || !pages_.lock(data, size)) {
    const std::lock_guard lock(mutex_);
    unlocked_.insert(data);
  }
  return data;
}

void StagingMemory::do_deallocate(void* data, std::size_t bytes, std::size_t alignment) {
  if (bytes < kMinBlockBytes) return upstream_->deallocate(data, bytes, alignment);
  const Block block{data, block_bytes(bytes)};
  std::vector<Block> surplus;
  {
    std::unique_lock lock(mutex_);
    if (ready_ && ready_->has(data)) return ready_->give_back(data, block.bytes);
    if (unlocked_.erase(data) != 0) {
      lock.unlock();
      return upstream_->deallocate(data, block.bytes, kPageBytes);
    }
    idle_.push_back(block);
    idle_bytes_ += block.bytes;
    auto kept = idle_.begin();
    for (; idle_bytes_ > max_idle_bytes_; ++kept) idle_bytes_ -= kept->bytes;
    surplus.assign(idle_.begin(), kept);
    idle_.erase(idle_.begin(), kept);
  }
  for (const Block& old : surplus) release(old);
}

bool StagingMemory::do_is_equal(const memory_resource& other) const noexcept {
  return this == &other;
}

// The most recently used: its pages are most likely cached.
void* StagingMemory::take_idle(std::size_t bytes, std::size_t alignment) {
  const std::lock_guard lock(mutex_);
  if (ready_ && alignment <= detail::Suballocator::kAlignment) {
    if (void* const data = ready_->take(bytes)) return data;
  }
  const auto newest = std::find_if(idle_.rbegin(), idle_.rend(),
                                   [&](const Block& block) { return block.bytes == bytes; });
  if (newest == idle_.rend()) return nullptr;
  void* const data = newest->data;
  idle_.erase(std::prev(newest.base()));
  idle_bytes_ -= bytes;
  return data;
}

void StagingMemory::release(const Block& block) {
  pages_.unlock(block.data);
  upstream_->deallocate(block.data, block.bytes, kPageBytes);
}

StagingMemory::PageLock page_lock(std::string_view backend) {
  return detail::cuda_page_lock(backend);
}

std::unique_ptr<StagingMemory> make_staging_memory(std::string_view backend,
                                                   std::size_t max_idle_bytes,
                                                   std::pmr::memory_resource* upstream,
                                                   std::size_t ready_bytes) {
  StagingMemory::PageLock pages = page_lock(backend);
  if (!pages.lock) return nullptr;
  return std::make_unique<StagingMemory>(std::move(pages), max_idle_bytes, upstream, ready_bytes);
}

}  // namespace meshsmooth
