#include <cuda_runtime_api.h>

#include "smooth/cuda/smoother.hpp"

namespace meshsmooth::detail {
namespace {

// Registering pages is several times as fast as cudaMallocHost. A failure is no error of a job and
// must not show up in a later call.
bool succeeded(cudaError_t result) {
  if (result != cudaSuccess) static_cast<void>(cudaGetLastError());
  return result == cudaSuccess;
}

}  // namespace

StagingMemory::PageLock cuda_page_lock(std::string_view backend) {
  const int device = cuda_device(backend);
  if (device < 0) return {};
  return {.lock =
              [device](void* data, std::size_t bytes) {
                // The calling thread may not have used CUDA before.
                return succeeded(cudaSetDevice(device)) &&
                       succeeded(cudaHostRegister(data, bytes, cudaHostRegisterPortable));
              },
          .unlock =
              [device](void* data) {
                succeeded(cudaSetDevice(device));
                succeeded(cudaHostUnregister(data));
              }};
}

}  // namespace meshsmooth::detail
