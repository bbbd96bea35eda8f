#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace meshsmooth {

/// Page-locked host memory, which a device copies from and to at full speed and concurrently with
/// its kernels. Locking is far more expensive than reuse, so freed blocks stay locked for the next
/// caller, up to a bound on the idle bytes; beyond it the least recently used block is released.
/// Blocks larger than the bound stay unlocked, so that an allocation takes milliseconds at most;
/// so do blocks that cannot be locked. What is locked from the start spares even the first callers
/// the time. Thread-safe.
class StagingMemory final : public std::pmr::memory_resource {
 public:
  /// How pages are locked. Called concurrently, by any thread.
  struct PageLock {
    std::function<bool(void* data, std::size_t bytes)> lock;  // false: failed
    std::function<void(void* data)> unlock;
  };

  /// @param pages           locks and unlocks
  /// @param max_idle_bytes  bound on the bytes that stay locked while unused
  /// @param upstream        gives the blocks, aligned to pages; must outlive this object
  /// @param ready_bytes     are locked from the start, if that many may be idle
  StagingMemory(PageLock pages, std::size_t max_idle_bytes,
                std::pmr::memory_resource* upstream = std::pmr::new_delete_resource(),
                std::size_t ready_bytes = 0);
  /// All blocks must have been deallocated.
  ~StagingMemory() override;
  StagingMemory(const StagingMemory&) = delete;
  StagingMemory& operator=(const StagingMemory&) = delete;

  /// @returns the bytes that an allocation of `bytes` really takes: at most an eighth more
  [[nodiscard]] static std::size_t block_bytes(std::size_t bytes);

  /// @returns the bytes that are locked but unused
  [[nodiscard]] std::size_t idle_bytes() const;

 private:
  struct Block {
    void* data;
    std::size_t bytes;
  };

  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override;
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override;

  [[nodiscard]] void* take_idle(std::size_t bytes, std::size_t alignment);
  void release(const Block& block);

  class Ready;

  const PageLock pages_;
  const std::size_t max_idle_bytes_;  // of blocks
  std::pmr::memory_resource* const upstream_;

  mutable std::mutex mutex_;
  std::vector<Block> idle_;  // the least recently used first; few enough for linear searches
  std::size_t idle_bytes_ = 0;
  std::unordered_set<const void*> unlocked_;  // in use, but could not be locked
  std::unique_ptr<Ready> ready_;              // null: nothing is locked from the start
};

/// @returns how the pages are locked that a backend copies from and to by itself; no functions for
/// one that works in host memory
[[nodiscard]] StagingMemory::PageLock page_lock(std::string_view backend);

/// Creates memory for the meshes of jobs of one backend.
///
/// @param backend  "cpu", "cuda:0" …
/// @returns null for a backend that works in host memory; other parameters as above
[[nodiscard]] std::unique_ptr<StagingMemory> make_staging_memory(
    std::string_view backend, std::size_t max_idle_bytes,
    std::pmr::memory_resource* upstream = std::pmr::new_delete_resource(),
    std::size_t ready_bytes = 0);

}  // namespace meshsmooth
