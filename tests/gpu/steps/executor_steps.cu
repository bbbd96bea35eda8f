#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/device_session.cuh"

namespace meshsmooth::test {

DeviceReduction reduce_on_device(const std::vector<std::uint32_t>& values) {
  DeviceSession device;
  const auto there = uploaded(device.executor, values);
  const std::uint32_t* const value = there.data();
  return device.executor.reduce(
      values.size(), DeviceReduction{0, ~0U},
      [=] __device__(std::size_t i) -> DeviceReduction {
        return {value[i], value[i]};
      },
      [] __device__(const DeviceReduction& a, const DeviceReduction& b) -> DeviceReduction {
        return {a.sum + b.sum, a.least < b.least ? a.least : b.least};
      });
}

std::int64_t scan_on_device(std::vector<std::int64_t>& values) {
  DeviceSession device;
  auto there = uploaded(device.executor, values);
  const std::int64_t sum = device.executor.exclusive_scan(there.data(), values.size());
  values = downloaded(device.executor, there.data(), values.size());
  return sum;
}

std::vector<std::uint64_t> sort_unique_on_device(std::vector<std::uint64_t> keys) {
  DeviceSession device;
  auto there = uploaded(device.executor, keys);
  device.executor.sort(there.data(), keys.size());
  const std::size_t count = device.executor.unique(there.data(), keys.size());
  return downloaded(device.executor, there.data(), count);
}

std::vector<std::size_t> lower_bounds_on_device(const std::vector<std::uint64_t>& keys,
                                                const std::vector<std::uint64_t>& values) {
  DeviceSession device;
  const auto there = uploaded(device.executor, keys);
  std::vector<std::size_t> result;
  for (const std::uint64_t value : values) {
    result.push_back(device.executor.lower_bound(there.data(), keys.size(), value));
  }
  return result;
}

}  // namespace meshsmooth::test
