#pragma once

#include <memory>
#include <vector>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A "cuda:N" for every device that the driver offers; none without a driver.
/// `available` where this build has code for it.
[[nodiscard]] std::vector<BackendInfo> list_cuda_backends();

/// The CUDA backend on one device: a stream of its own. Throws NotSupported
/// (BACKEND_NOT_AVAILABLE).
[[nodiscard]] std::unique_ptr<Smoother> make_cuda_smoother(int device);

}  // namespace meshsmooth::detail
