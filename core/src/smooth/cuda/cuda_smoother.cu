#include "smooth/cuda/cuda_smoother.hpp"

#include <string>

#include "meshsmooth/error.hpp"
#include "smooth/cuda/check.hpp"

namespace meshsmooth::detail {

std::vector<BackendInfo> list_cuda_backends() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) {
    static_cast<void>(cudaGetLastError());
    return {};
  }
  std::vector<BackendInfo> backends;
  for (int device = 0; device < count; ++device) {
    cudaDeviceProp properties{};
    check_cuda(cudaGetDeviceProperties(&properties, device), "asking for a device's properties");
    backends.push_back({"cuda:" + std::to_string(device),
                        properties.major * 10 + properties.minor >= 75, properties.name});
  }
  return backends;
}

std::unique_ptr<Smoother> make_cuda_smoother(int device) {
  const std::vector<BackendInfo> backends = list_cuda_backends();
  throw NotSupported("BACKEND_NOT_AVAILABLE",
                     "backend 'cuda:" + std::to_string(device) + "' is not available: " +
                         (backends.empty() ? std::string("there is no NVIDIA driver or device")
                                           : std::to_string(backends.size()) + " devices"),
                     {{"field", "backend"}});
}

}  // namespace meshsmooth::detail
