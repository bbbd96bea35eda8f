// Locked memory and its recycling, with a lock that only counts.
#include "meshsmooth/staging_memory.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace meshsmooth {
namespace {

constexpr std::size_t kMiB = 1 << 20;

/// Counts what is allocated and locked.
class Counting final : public std::pmr::memory_resource {
 public:
  [[nodiscard]] StagingMemory::PageLock pages() {
    return {.lock =
                [this](void* data, std::size_t bytes) {
                  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(data) % 4096, 0U);
                  EXPECT_EQ(bytes % 4096, 0U);
                  ++lock_count;
                  if (failing) return false;
                  locked_bytes += bytes;
                  const std::lock_guard lock(mutex_);
                  return locked_.emplace(data, bytes).second;
                },
            .unlock =
                [this](void* data) {
                  const std::lock_guard lock(mutex_);
                  const auto found = locked_.find(data);
                  ASSERT_NE(found, locked_.end());
                  locked_bytes -= found->second;
                  locked_.erase(found);
                }};
  }

  std::atomic<bool> failing = false;
  std::atomic<int> lock_count = 0;
  std::atomic<std::size_t> locked_bytes = 0;
  std::atomic<std::size_t> allocated_bytes = 0;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    allocated_bytes += bytes;
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override {
    allocated_bytes -= bytes;
    std::pmr::new_delete_resource()->deallocate(data, bytes, alignment);
  }
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override {
    return this == &other;
  }

  std::mutex mutex_;
  std::map<void*, std::size_t> locked_;
};

class StagingMemoryTest : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_EQ(counting_.locked_bytes, 0U);
    EXPECT_EQ(counting_.allocated_bytes, 0U);
  }

  Counting counting_;
};

TEST_F(StagingMemoryTest, RoundsUpByAtMostAnEighth) {
  for (std::size_t bytes = 1; bytes < std::size_t{1} << 40; bytes += 1 + bytes / 7) {
    const std::size_t block = StagingMemory::block_bytes(bytes);

    EXPECT_GE(block, bytes);
    EXPECT_LE(block - bytes, bytes / 8) << bytes;
    EXPECT_EQ(StagingMemory::block_bytes(block), block) << bytes;
  }
}

TEST_F(StagingMemoryTest, TakesWhatItSays) {
  StagingMemory memory(counting_.pages(), 0, &counting_);
  for (const std::size_t bytes : {std::size_t{100}, 33 * kMiB / 32, 5 * kMiB}) {
    void* const data = memory.allocate(bytes, 64);

    EXPECT_EQ(counting_.allocated_bytes, StagingMemory::block_bytes(bytes));
    std::memset(data, 1, bytes);
    memory.deallocate(data, bytes, 64);
  }
}

TEST_F(StagingMemoryTest, LocksABlockOnceForManyUsers) {
  StagingMemory memory(counting_.pages(), 8 * kMiB, &counting_);
  for (int use = 0; use < 5; ++use) {
    // Sizes of one class.
    const std::size_t bytes = 3 * kMiB - static_cast<std::size_t>(use);
    memory.deallocate(memory.allocate(bytes, 64), bytes, 64);
  }

  EXPECT_EQ(counting_.lock_count, 1);
  EXPECT_EQ(memory.idle_bytes(), 3 * kMiB);
}

TEST_F(StagingMemoryTest, NeverGivesABlockToTwo) {
  StagingMemory memory(counting_.pages(), 8 * kMiB, &counting_);
  void* const first = memory.allocate(kMiB, 64);
  void* const second = memory.allocate(kMiB, 64);

  EXPECT_NE(first, second);
  memory.deallocate(first, kMiB, 64);
  void* const third = memory.allocate(kMiB, 64);
  EXPECT_EQ(third, first);
  memory.deallocate(second, kMiB, 64);
  memory.deallocate(third, kMiB, 64);
  EXPECT_EQ(memory.idle_bytes(), 2 * kMiB);
}

TEST_F(StagingMemoryTest, LetsTheBlockGoThatWasNotUsedForLongest) {
  StagingMemory memory(counting_.pages(), 4 * kMiB, &counting_);
  void* const small = memory.allocate(kMiB, 64);
  void* const large = memory.allocate(3 * kMiB, 64);
  void* const other = memory.allocate(2 * kMiB, 64);
  memory.deallocate(small, kMiB, 64);
  memory.deallocate(large, 3 * kMiB, 64);
  memory.deallocate(other, 2 * kMiB, 64);  // 6 MiB: small and large have to go

  EXPECT_EQ(memory.idle_bytes(), 2 * kMiB);
  EXPECT_EQ(counting_.locked_bytes, 2 * kMiB);
  void* const again = memory.allocate(2 * kMiB, 64);
  EXPECT_EQ(again, other);
  memory.deallocate(again, 2 * kMiB, 64);
  EXPECT_EQ(counting_.lock_count, 3);
}

TEST_F(StagingMemoryTest, IsOrdinaryMemoryWhereLockingFails) {
  counting_.failing = true;
  StagingMemory memory(counting_.pages(), 8 * kMiB, &counting_);

  void* const data = memory.allocate(kMiB, 64);

  std::memset(data, 1, kMiB);
  memory.deallocate(data, kMiB, 64);
  EXPECT_EQ(memory.idle_bytes(), 0U);
  // The next one tries again.
  counting_.failing = false;
  memory.deallocate(memory.allocate(kMiB, 64), kMiB, 64);
  EXPECT_EQ(memory.idle_bytes(), kMiB);
}

TEST_F(StagingMemoryTest, DoesNotLockWhatItCouldNotKeep) {
  StagingMemory memory(counting_.pages(), 4 * kMiB, &counting_);

  memory.deallocate(memory.allocate(5 * kMiB, 64), 5 * kMiB, 64);

  EXPECT_EQ(counting_.lock_count, 0);
  EXPECT_EQ(memory.idle_bytes(), 0U);
}

TEST_F(StagingMemoryTest, GivesWhatIsLockedFromTheStart) {
  StagingMemory memory(counting_.pages(), 8 * kMiB, &counting_, 4 * kMiB);
  const int locks = counting_.lock_count;
  EXPECT_EQ(memory.idle_bytes(), 4 * kMiB);

  void* const first = memory.allocate(kMiB);
  void* const second = memory.allocate(2 * kMiB);
  EXPECT_EQ(counting_.lock_count, locks);
  EXPECT_EQ(memory.idle_bytes(), kMiB);
  void* const third = memory.allocate(2 * kMiB);  // there is no room
  EXPECT_EQ(counting_.lock_count, locks + 1);

  for (const auto& [data, bytes] :
       {std::pair(first, kMiB), {second, 2 * kMiB}, {third, 2 * kMiB}}) {
    std::memset(data, 1, bytes);
    memory.deallocate(data, bytes);
  }
  EXPECT_EQ(memory.idle_bytes(), 6 * kMiB);
}

TEST_F(StagingMemoryTest, ServesManyThreads) {
  StagingMemory memory(counting_.pages(), 4 * kMiB, &counting_);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&memory, t] {
      for (int i = 0; i < 500; ++i) {
        const std::size_t bytes =
            10'000U + static_cast<std::size_t>((t * 7919 + i * 104'729) % 1'500'000);
        auto* const data = static_cast<unsigned char*>(memory.allocate(bytes, 64));
        const auto mark = static_cast<unsigned char>(t + 1);
        data[0] = data[bytes - 1] = mark;
        std::this_thread::yield();
        EXPECT_EQ(data[0], mark);
        EXPECT_EQ(data[bytes - 1], mark);
        memory.deallocate(data, bytes, 64);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();

  EXPECT_LE(memory.idle_bytes(), 4 * kMiB);
  EXPECT_EQ(counting_.locked_bytes, memory.idle_bytes());
}

TEST(MakeStagingMemory, HasNoneForTheCpu) { EXPECT_EQ(make_staging_memory("cpu", kMiB), nullptr); }

}  // namespace
}  // namespace meshsmooth
