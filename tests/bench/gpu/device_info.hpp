#pragma once

#include <string>

#include "gpu/report.hpp"

namespace meshsmooth::bench {

/// The current CUDA device; an empty name where there is none.
struct DeviceInfo {
  std::string name;
  int multiprocessor_count = 0;
  int driver_version = 0;  // 13000 is 13.0
  int runtime_version = 0;
};
[[nodiscard]] DeviceInfo find_device();
[[nodiscard]] Json to_json(const DeviceInfo& device);

}  // namespace meshsmooth::bench
