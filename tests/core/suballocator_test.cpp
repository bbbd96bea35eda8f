#include "smooth/cuda/device/suballocator.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace meshsmooth::detail {
namespace {

TEST(Slab, GivesWholeUnitsUntilItIsFull) {
  Slab slab(4 * Slab::kUnit + 1);
  EXPECT_EQ(slab.take(1), 0U);
  EXPECT_EQ(slab.take(Slab::kUnit + 1), Slab::kUnit);
  EXPECT_EQ(slab.take(2 * Slab::kUnit), Slab::kFull);
  EXPECT_EQ(slab.take(Slab::kUnit), 3 * Slab::kUnit);
  EXPECT_EQ(slab.take(1), Slab::kFull);
}

TEST(Slab, OfNothingIsFull) {
  Slab slab(0);
  EXPECT_EQ(slab.take(1), Slab::kFull);
}

TEST(Slab, JoinsWhatComesBackOnBothSides) {
  constexpr std::size_t kUnit = Slab::kUnit;
  Slab slab(3 * kUnit);
  for (std::size_t n = 0; n < 3; ++n) ASSERT_EQ(slab.take(kUnit), n * kUnit);
  slab.give(0, kUnit);
  slab.give(2 * kUnit, kUnit);
  EXPECT_EQ(slab.free_stretches(), 2U);
  slab.give(kUnit, kUnit);
  EXPECT_EQ(slab.free_stretches(), 1U);
  EXPECT_EQ(slab.take(3 * kUnit), 0U);
}

TEST(Slab, NeverGivesAStretchTwiceAndLosesNone) {
  constexpr std::size_t kCapacity = 1000 * Slab::kUnit;
  Slab slab(kCapacity);
  std::map<std::size_t, std::size_t> taken;  // size by offset
  std::mt19937 random(1);
  for (int step = 0; step < 20'000; ++step) {
    if (random() % 2 == 0 && !taken.empty()) {
      const auto one =
          std::next(taken.begin(), static_cast<std::ptrdiff_t>(random() % taken.size()));
      slab.give(one->first, one->second);
      taken.erase(one);
      continue;
    }
    const std::size_t size = 1 + random() % (50 * Slab::kUnit);
    const std::size_t offset = slab.take(size);
    if (offset == Slab::kFull) continue;
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
  for (const auto& [offset, size] : taken) slab.give(offset, size);
  EXPECT_EQ(slab.free_stretches(), 1U);
  EXPECT_EQ(slab.take(kCapacity), 0U);
}

}  // namespace
}  // namespace meshsmooth::detail
