#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/staging_memory.hpp"

/// What the library knows of the CUDA backend; no_cuda.cpp replaces it.
namespace meshsmooth::detail {

/// N of "cuda:N", 0 of "cuda", else -1.
[[nodiscard]] inline int cuda_device(std::string_view backend) {
  const auto name = parse_backend_name(backend);
  return name && name->kind == BackendKind::cuda ? name->device.value_or(0) : -1;
}

/// A "cuda:N" for each device of the driver, `available` if this build has code for it; without
/// driver or device one "cuda" that is not available; none in a build without CUDA.
[[nodiscard]] std::vector<BackendInfo> list_cuda_backends();

/// The CUDA backend on one device, with a lane of its own. Throws NotSupported
/// (BACKEND_NOT_AVAILABLE).
[[nodiscard]] std::unique_ptr<Smoother> make_cuda_smoother(int device);

/// Page-locks memory for a device; without `lock` if `backend` is not a CUDA device.
[[nodiscard]] StagingMemory::PageLock cuda_page_lock(std::string_view backend);

}  // namespace meshsmooth::detail
