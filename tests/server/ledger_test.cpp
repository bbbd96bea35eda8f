#include "ledger.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::string reason_of(Ledger& ledger, MemoryEstimate need) {
  try {
    (void)ledger.reserve(need);
  } catch (const OutOfMemory& error) {
    return error.reason();
  }
  return "reserved";
}

TEST(Ledger, CountsWhatIsPromisedUntilItIsGivenBack) {
  Ledger ledger({.host_bytes = 100, .device_bytes = 50});
  {
    const Reservation first = ledger.reserve({60, 20});
    const Reservation second = ledger.reserve({40, 30});
    EXPECT_EQ(ledger.reserved().host_bytes, 100);
    EXPECT_EQ(ledger.reserved().device_bytes, 50);
  }
  EXPECT_EQ(ledger.reserved().host_bytes, 0);
  EXPECT_EQ(ledger.reserved().device_bytes, 0);
}

TEST(Ledger, TellsBusyFromNever) {
  Ledger ledger({.host_bytes = 100, .device_bytes = 50});
  const Reservation held = ledger.reserve({60, 30});

  EXPECT_EQ(reason_of(ledger, {41, 0}), "HOST_MEMORY_BUSY");
  EXPECT_EQ(reason_of(ledger, {0, 21}), "DEVICE_MEMORY_BUSY");
  EXPECT_EQ(reason_of(ledger, {101, 0}), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(ledger, {0, 51}), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(ledger, {INT64_MAX, 0}), "MESH_TOO_LARGE");
  EXPECT_EQ(ledger.reserved().host_bytes, 60);
}

TEST(Reservation, GivesBackOnceHoweverOftenItIsMoved) {
  Ledger ledger({.host_bytes = 100, .device_bytes = 0});
  std::optional<Reservation> moved;
  {
    Reservation first = ledger.reserve({10, 0});
    moved = std::move(first);
  }
  EXPECT_EQ(ledger.reserved().host_bytes, 10);
  moved.reset();
  EXPECT_EQ(ledger.reserved().host_bytes, 0);
}

TEST(Ledger, StaysBalancedWithManyThreads) {
  Ledger ledger({.host_bytes = 1000, .device_bytes = 0});
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&ledger] {
      for (int i = 0; i < 2000; ++i) (void)reason_of(ledger, {300, 0});
    });
  }
  for (std::thread& thread : threads) thread.join();

  EXPECT_EQ(ledger.reserved().host_bytes, 0);
}

}  // namespace
}  // namespace meshsmooth::server
