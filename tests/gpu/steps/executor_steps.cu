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

}  // namespace meshsmooth::test
