#include "smooth/cuda/base/lane.hpp"

#include <algorithm>
#include <cstdlib>

namespace meshsmooth::detail {
namespace {

/// Bytes that a lane keeps between jobs.
std::size_t release_threshold() {
  std::size_t free = 0, total = 0;
  check_cuda(cudaMemGetInfo(&free, &total), "querying device memory");
  return std::min<std::size_t>(std::size_t{2} << 30, total / 16);
}

/// compute-sanitizer tracks the driver's allocations only: its runs have no arena.
std::size_t arena_bytes() {
  const bool plain = std::getenv("MESHSMOOTH_PLAIN_DEVICE_MEMORY") != nullptr;
  return plain ? 0 : std::min<std::size_t>(std::size_t{64} << 20, release_threshold() / 4);
}

int attribute(cudaDeviceAttr attribute, int device) {
  int value = 0;
  check_cuda(cudaDeviceGetAttribute(&value, attribute, device), "querying device attributes");
  return value;
}

}  // namespace

CudaLane::CudaLane(int device)
    : device_(device),
      pool_(stream, device, release_threshold(), arena_bytes()),
      shapes_(kLinearTypeCount, {pool_, resident_}),
      ticket_(1, {pool_, resident_}) {
  constexpr int kStaticBytes = 256;  // static shared memory of a kernel
  limits_.multiprocessors = attribute(cudaDevAttrMultiProcessorCount, device);
  limits_.shared_bytes = static_cast<std::size_t>(
      attribute(cudaDevAttrMaxSharedMemoryPerBlockOptin, device) - kStaticBytes);
  check_cuda(cudaMemcpyAsync(shapes_.data(), element_table().data(),
                             kLinearTypeCount * sizeof(ElementShape), cudaMemcpyHostToDevice,
                             stream.get()),
             "copying to the device");
  check_cuda(cudaMemsetAsync(ticket_.data(), 0, sizeof(unsigned int), stream.get()),
             "clearing device memory");
  stream.synchronize();
}

unsigned char* CudaLane::staging(std::size_t bytes) {
  if (bytes > staging_size_) {
    staging_.emplace(bytes);
    staging_size_ = bytes;
  }
  return staging_->data();
}

}  // namespace meshsmooth::detail
