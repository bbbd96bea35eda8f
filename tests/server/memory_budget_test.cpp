#include "memory_budget.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::string reason_of(MemoryBudget& budget, MemoryEstimate need) {
  try {
    (void)budget.reserve(need);
  } catch (const OutOfMemory& error) {
    return error.reason();
  }
  return "reserved";
}

TEST(MemoryBudget, CountsWhatIsPromisedUntilItIsGivenBack) {
  MemoryBudget budget({100, {50}});
  {
    const Reservation first = budget.reserve({60, 20});
    const Reservation second = budget.reserve({40, 30});
    EXPECT_EQ(budget.reserved().host_bytes, 100);
    EXPECT_EQ(budget.reserved().device_bytes.front(), 50);
  }
  EXPECT_EQ(budget.reserved().host_bytes, 0);
  EXPECT_EQ(budget.reserved().device_bytes.front(), 0);
}

TEST(MemoryBudget, TellsBusyFromNever) {
  MemoryBudget budget({100, {50}});
  const Reservation held = budget.reserve({60, 30});

  EXPECT_EQ(reason_of(budget, {41, 0}), "HOST_MEMORY_BUSY");
  EXPECT_EQ(reason_of(budget, {0, 21}), "DEVICE_MEMORY_BUSY");
  EXPECT_EQ(reason_of(budget, {101, 0}), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(budget, {0, 51}), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(budget, {INT64_MAX, 0}), "MESH_TOO_LARGE");
  EXPECT_EQ(budget.reserved().host_bytes, 60);
}

TEST(MemoryBudget, GivesJobsToThePreferredDeviceElseToTheLeastPromised) {
  MemoryBudget budget({100, {50, 80, 50}});
  const auto device_of = [&](std::int64_t need, std::vector<int> preferred = {}) {
    return budget.reserve({0, need}, preferred).device();
  };
  EXPECT_EQ(device_of(10), 0);
  const Reservation first = budget.reserve_on(0, {0, 30});
  const Reservation second = budget.reserve_on(1, {0, 20});
  EXPECT_EQ(device_of(10), 2);
  EXPECT_EQ(device_of(10, {0}), 0);
  EXPECT_EQ(device_of(30, {0}), 2) << "it has no room";
  EXPECT_EQ(device_of(60), 1) << "the only one with room";
  EXPECT_EQ(budget.reserved().device_bytes, (std::vector<std::int64_t>{30, 20, 0}));

  EXPECT_EQ(reason_of(budget, {0, 61}), "DEVICE_MEMORY_BUSY");
  EXPECT_EQ(reason_of(budget, {0, 81}), "MESH_TOO_LARGE");
  EXPECT_THROW((void)budget.reserve_on(0, {0, 51}), OutOfMemory);
}

TEST(Reservation, GivesBackOnceHoweverOftenItIsMoved) {
  MemoryBudget budget({100, {0}});
  std::optional<Reservation> moved;
  {
    Reservation first = budget.reserve({10, 0});
    moved = std::move(first);
  }
  EXPECT_EQ(budget.reserved().host_bytes, 10);
  moved.reset();
  EXPECT_EQ(budget.reserved().host_bytes, 0);
}

TEST(Reservation, GrowsBeyondWhatIsFreeButNotBeyondTheLimit) {
  MemoryBudget budget({100, {0}});
  {
    Reservation running = budget.reserve({50, 0});
    const Reservation waiting = budget.reserve({45, 0});
    running.grow(20);
    EXPECT_EQ(running.bytes().host_bytes, 70);
    EXPECT_EQ(budget.reserved().host_bytes, 115);
    EXPECT_EQ(reason_of(budget, {1, 0}), "HOST_MEMORY_BUSY");
    EXPECT_THROW(running.grow(31), OutOfMemory);
    EXPECT_EQ(budget.reserved().host_bytes, 115);
  }
  EXPECT_EQ(budget.reserved().host_bytes, 0);
}

TEST(MemoryBudget, StaysBalancedWithManyThreads) {
  MemoryBudget budget({1000, {0}});
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&budget] {
      for (int i = 0; i < 2000; ++i) (void)reason_of(budget, {300, 0});
    });
  }
  for (std::thread& thread : threads) thread.join();

  EXPECT_EQ(budget.reserved().host_bytes, 0);
}

}  // namespace
}  // namespace meshsmooth::server
