#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

namespace meshsmooth {

/// Host memory that a device copies from and to at full speed, beside its kernels:
/// its pages are locked. Locking costs far more than using them, so blocks that
/// come back stay locked for the next caller, up to a bound; then the one that was
/// not used for longest goes. What is larger than the bound is not locked, so that
/// an allocation takes milliseconds at most; where locking fails neither.
/// Thread-safe.
class StagingMemory final : public std::pmr::memory_resource {
 public:
  /// How pages are locked. Called by any thread, several at a time.
  struct PageLock {
    std::function<bool(void* data, std::size_t bytes)> lock;  // false: they are not
    std::function<void(void* data)> unlock;
  };

  /// Blocks come from `upstream`, aligned to pages; it must outlive this.
  StagingMemory(PageLock pages, std::size_t max_idle_bytes,
                std::pmr::memory_resource* upstream = std::pmr::new_delete_resource());
  /// Needs all memory to have come back.
  ~StagingMemory() override;
  StagingMemory(const StagingMemory&) = delete;
  StagingMemory& operator=(const StagingMemory&) = delete;

  /// What an allocation of `bytes` takes: at most an eighth more.
  [[nodiscard]] static std::size_t block_bytes(std::size_t bytes);

  /// Locked, and used by nobody.
  [[nodiscard]] std::size_t idle_bytes() const;

 private:
  struct Block {
    void* data;
    std::size_t bytes;
  };

  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override;
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override;

  [[nodiscard]] void* take_idle(std::size_t bytes);
  void release(const Block& block);

  const PageLock pages_;
  const std::size_t max_idle_bytes_;
  std::pmr::memory_resource* const upstream_;

  mutable std::mutex mutex_;
  std::map<std::uint64_t, Block> by_age_;  // the idle blocks, by a number that grows
  std::map<std::pair<std::size_t, std::uint64_t>, void*> by_size_;  // the same: bytes, number
  std::uint64_t next_age_ = 0;
  std::size_t idle_bytes_ = 0;
  std::unordered_set<const void*> unlocked_;  // in use, but could not be locked
};

/// Memory for the meshes of jobs that run on `backend` ("cuda:0"); nothing for a
/// backend that works in the host's memory.
[[nodiscard]] std::unique_ptr<StagingMemory> make_staging_memory(
    std::string_view backend, std::size_t max_idle_bytes,
    std::pmr::memory_resource* upstream = std::pmr::new_delete_resource());

}  // namespace meshsmooth
