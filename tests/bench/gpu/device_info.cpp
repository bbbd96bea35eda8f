#include "gpu/device_info.hpp"

#include "gpu/cuda.hpp"

namespace meshsmooth::bench {

DeviceInfo find_device() {
  DeviceInfo device;
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) {
    static_cast<void>(cudaGetLastError());
    return device;
  }
  int current = 0;
  cudaDeviceProp properties{};
  check_cuda(cudaGetDevice(&current), "asking for the device");
  check_cuda(cudaGetDeviceProperties(&properties, current), "asking for its properties");
  check_cuda(cudaDriverGetVersion(&device.driver_version), "asking for the driver's version");
  check_cuda(cudaRuntimeGetVersion(&device.runtime_version), "asking for the runtime's version");
  device.name = properties.name;
  device.multiprocessor_count = properties.multiProcessorCount;
  return device;
}

Json to_json(const DeviceInfo& device) {
  Json json;
  json.set("name", device.name)
      .set("multiprocessors", device.multiprocessor_count)
      .set("driver_version", device.driver_version)
      .set("runtime_version", device.runtime_version);
  return json;
}

}  // namespace meshsmooth::bench
