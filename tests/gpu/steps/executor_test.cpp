// What every step of the CUDA backend stands on: reductions and scans.

#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "gpu/steps/cuda_steps.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

/// Around a warp, a block, the blocks of one reduction.
constexpr std::size_t kSizes[] = {1, 31, 32, 33, 255, 256, 257, 1000, 262143, 262145, 600001};

template <class T>
std::vector<T> random_values(std::size_t count, T most) {
  std::mt19937_64 random(count);
  std::vector<T> values(count);
  for (T& value : values) value = static_cast<T>(random() % (static_cast<std::uint64_t>(most) + 1));
  return values;
}

class CudaExecutorVerbs : public test::CudaTest {};

TEST_F(CudaExecutorVerbs, ReduceEveryItemOnce) {
  for (const std::size_t size : kSizes) {
    const auto values = random_values<std::uint32_t>(size, 1'000'000);

    const test::DeviceReduction found = test::reduce_on_device(values);

    EXPECT_EQ(found.sum, std::accumulate(values.begin(), values.end(), std::uint64_t{0})) << size;
    EXPECT_EQ(found.least, *std::min_element(values.begin(), values.end())) << size;
  }
}

TEST_F(CudaExecutorVerbs, ScanGivesTheSumBeforeEachItem) {
  for (const std::size_t size : kSizes) {
    std::vector<std::int64_t> values = random_values<std::int64_t>(size, 1'000'000'000'000);
    std::vector<std::int64_t> expected(size);
    std::exclusive_scan(values.begin(), values.end(), expected.begin(), std::int64_t{0});
    const std::int64_t sum = std::accumulate(values.begin(), values.end(), std::int64_t{0});

    EXPECT_EQ(test::scan_on_device(values), sum) << size;
    EXPECT_EQ(values, expected) << size;
  }
}

}  // namespace
}  // namespace meshsmooth
