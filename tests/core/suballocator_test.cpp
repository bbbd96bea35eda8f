#include "smooth/cuda/base/suballocator.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace meshsmooth::detail {
namespace {

TEST(Suballocator, AllocatesAlignedRangesUntilItIsFull) {
  Suballocator memory(4 * Suballocator::kAlignment + 1);
  EXPECT_EQ(memory.allocate(1), 0U);
  EXPECT_EQ(memory.allocate(Suballocator::kAlignment + 1), Suballocator::kAlignment);
  EXPECT_EQ(memory.allocate(2 * Suballocator::kAlignment), Suballocator::kFull);
  EXPECT_EQ(memory.allocate(Suballocator::kAlignment), 3 * Suballocator::kAlignment);
  EXPECT_EQ(memory.allocate(1), Suballocator::kFull);
}

TEST(Suballocator, OfNoCapacityIsFull) {
  Suballocator memory(0);
  EXPECT_EQ(memory.allocate(1), Suballocator::kFull);
}

TEST(Suballocator, CoalescesReleasedRangesOnBothSides) {
  constexpr std::size_t kAlignment = Suballocator::kAlignment;
  Suballocator memory(3 * kAlignment);
  for (std::size_t n = 0; n < 3; ++n) ASSERT_EQ(memory.allocate(kAlignment), n * kAlignment);
  memory.release(0, kAlignment);
  memory.release(2 * kAlignment, kAlignment);
  EXPECT_EQ(memory.free_range_count(), 2U);
  memory.release(kAlignment, kAlignment);
  EXPECT_EQ(memory.free_range_count(), 1U);
  EXPECT_EQ(memory.allocate(3 * kAlignment), 0U);
}

TEST(Suballocator, NeverAllocatesARangeTwiceAndLosesNone) {
  constexpr std::size_t kCapacity = 1000 * Suballocator::kAlignment;
  Suballocator memory(kCapacity);
  std::map<std::size_t, std::size_t> taken;  // size by offset
  std::mt19937 random(1);
  for (int step = 0; step < 20'000; ++step) {
    if (random() % 2 == 0 && !taken.empty()) {
      const auto one =
          std::next(taken.begin(), static_cast<std::ptrdiff_t>(random() % taken.size()));
      memory.release(one->first, one->second);
      taken.erase(one);
      continue;
    }
    const std::size_t size = 1 + random() % (50 * Suballocator::kAlignment);
    const std::size_t offset = memory.allocate(size);
    if (offset == Suballocator::kFull) continue;
    const auto [at, fresh] = taken.emplace(offset, size);
    ASSERT_TRUE(fresh);
    ASSERT_LE(offset + size, kCapacity);
    if (at != taken.begin()) {
      ASSERT_LE(std::prev(at)->first + std::prev(at)->second, offset);
    }
    if (std::next(at) != taken.end()) {
      ASSERT_LE(offset + size, std::next(at)->first);
    }
  }
  for (const auto& [offset, size] : taken) memory.release(offset, size);
  EXPECT_EQ(memory.free_range_count(), 1U);
  EXPECT_EQ(memory.allocate(kCapacity), 0U);
}

}  // namespace
}  // namespace meshsmooth::detail
