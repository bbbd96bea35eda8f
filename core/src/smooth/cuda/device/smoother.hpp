#pragma once

#include <memory>
#include <vector>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A "cuda:N" for each device of the driver, `available` if this build has code for it; without
/// driver or device one "cuda" that is not available; none in a build without CUDA.
[[nodiscard]] std::vector<BackendInfo> list_cuda_backends();

/// The CUDA backend on one device, with a lane of its own. Throws NotSupported
/// (BACKEND_NOT_AVAILABLE).
[[nodiscard]] std::unique_ptr<Smoother> make_cuda_smoother(int device);

}  // namespace meshsmooth::detail
