#pragma once

#include <cuda_runtime_api.h>

#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth::detail {

/// Throws unless a call of the CUDA runtime succeeded: OutOfMemory (DEVICE_MEMORY_EXHAUSTED),
/// DeviceError (DEVICE_REFUSED), or a fatal DeviceError (DEVICE_LOST), after which the context of
/// the process must be considered lost. `what` is the purpose of the call.
inline void check_cuda(cudaError_t result, const char* what) {
  if (result == cudaSuccess) return;
  static_cast<void>(cudaGetLastError());  // a non-sticky error must not show up again later
  const std::string message = std::string(what) + ": " + cudaGetErrorString(result);
  if (result == cudaErrorMemoryAllocation) {
    throw OutOfMemory("DEVICE_MEMORY_EXHAUSTED",
                      "device memory: " + message + "; use a smaller mesh");
  }
  switch (result) {
    // The call was refused; the device is unchanged.
    case cudaErrorInvalidValue:
    case cudaErrorInvalidConfiguration:
    case cudaErrorNotSupported:
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorLaunchOutOfResources:
    case cudaErrorCooperativeLaunchTooLarge:
      throw DeviceError("DEVICE_REFUSED", message, false);
    default:
      throw DeviceError("DEVICE_LOST", message, true);
  }
}

}  // namespace meshsmooth::detail
