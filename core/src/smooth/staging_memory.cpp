#include "meshsmooth/staging_memory.hpp"

#include <algorithm>
#include <bit>
#include <iterator>

#include "smooth/cuda/device/smoother.hpp"

namespace meshsmooth {
namespace {

constexpr std::size_t kPageBytes = 4096;

// Smaller blocks are copied about as fast unlocked.
constexpr std::size_t kMinBlockBytes = 8 * kPageBytes;

}  // namespace

StagingMemory::StagingMemory(PageLock pages, std::size_t max_idle_bytes,
                             std::pmr::memory_resource* upstream)
    : pages_(std::move(pages)), max_idle_bytes_(max_idle_bytes), upstream_(upstream) {}

StagingMemory::~StagingMemory() {
  for (const Block& block : idle_) release(block);
}

// Eight sizes between successive powers of two; always whole pages.
std::size_t StagingMemory::block_bytes(std::size_t bytes) {
  if (bytes < kMinBlockBytes) return bytes;
  const std::size_t step = std::bit_floor(bytes) / 8;
  return (bytes + step - 1) / step * step;
}

std::size_t StagingMemory::idle_bytes() const {
  const std::lock_guard lock(mutex_);
  return idle_bytes_;
}

void* StagingMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (bytes < kMinBlockBytes) return upstream_->allocate(bytes, alignment);
  const std::size_t size = block_bytes(bytes);
  if (void* const data = take_idle(size)) return data;
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
void* StagingMemory::take_idle(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
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

std::unique_ptr<StagingMemory> make_staging_memory(std::string_view backend,
                                                   std::size_t max_idle_bytes,
                                                   std::pmr::memory_resource* upstream) {
  StagingMemory::PageLock pages = detail::cuda_page_lock(backend);
  if (!pages.lock) return nullptr;
  return std::make_unique<StagingMemory>(std::move(pages), max_idle_bytes, upstream);
}

}  // namespace meshsmooth
