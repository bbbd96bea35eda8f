#include "mesh/parallel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include "support/sanitizer.hpp"

namespace meshsmooth::detail {
namespace {

class Parallel : public ::testing::Test {
 protected:
  tbb::global_control enough_{tbb::global_control::max_allowed_parallelism, 4};
  tbb::task_arena arena_{4};
};

TEST_F(Parallel, CallsABodyForEveryIndexOnce) {
  for (const std::size_t count : {0, 1, 2, 1000}) {
    std::vector<int> calls(count);
    run_in(arena_, [&] { parallel_for(count, [&](std::size_t i) { ++calls[i]; }); });
    EXPECT_THAT(calls, ::testing::Each(1)) << count;
  }
}

TEST_F(Parallel, CoversARangeWithoutOverlap) {
  for (const std::size_t count : {std::size_t{0}, kRange - 1, kRange, kRange + 1, 5 * kRange}) {
    std::vector<int> calls(count);
    run_in(arena_, [&] {
      parallel_for_ranges(count, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++calls[i];
      });
    });
    EXPECT_THAT(calls, ::testing::Each(1)) << count;
  }
}

TEST_F(Parallel, CombinesInOrder) {
  const auto begins = run_in(arena_, [] {
    return parallel_reduce(
        4 * kRange, std::string(),
        [](std::size_t i) { return i % kRange == 0 ? " " + std::to_string(i / kRange) : ""; },
        std::plus<>());
  });
  EXPECT_EQ("from" + begins, "from 0 1 2 3");
}

TEST_F(Parallel, ThrowsWhatABodyThrows) {
  const auto loop = [&] {
    run_in(arena_, [] {
      parallel_for(100, [](std::size_t i) {
        if (i == 70) throw std::runtime_error("the seventieth");
      });
    });
  };
  EXPECT_THAT(loop, ::testing::ThrowsMessage<std::runtime_error>("the seventieth"));
}

/// Two functors on two threads that add to one number, and know nothing of each other.
void race() {
  const auto enough = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  tbb::task_arena arena(2);
  std::atomic<int> running = 0;
  int sum = 0;
  run_in(arena, [&] {
    parallel_for(2, [&](std::size_t) {
      running.fetch_add(1, std::memory_order_relaxed);
      while (running.load(std::memory_order_relaxed) < 2 &&
             std::chrono::steady_clock::now() < enough) {
        std::this_thread::yield();
      }
      ++sum;
    });
  });
}

TEST_F(Parallel, RacesBetweenFunctorsAreFound) {
  if (!meshsmooth::testing::kThreadSanitizer) GTEST_SKIP() << "by the thread sanitizer alone";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(race(), "ThreadSanitizer: data race");
}

}  // namespace
}  // namespace meshsmooth::detail
