#pragma once

#include <memory>
#include <vector>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A "cuda:N" for every device that the driver offers, `available` where this
/// build has code for it; without a driver or device one "cuda", not available;
/// none in a build without CUDA.
[[nodiscard]] std::vector<BackendInfo> list_cuda_backends();

/// The CUDA backend on one device: a stream of its own. Throws NotSupported
/// (BACKEND_NOT_AVAILABLE).
[[nodiscard]] std::unique_ptr<Smoother> make_cuda_smoother(int device);

}  // namespace meshsmooth::detail
