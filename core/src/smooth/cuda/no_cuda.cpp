// Replaces the CUDA backend in builds without it.
#include "meshsmooth/error.hpp"
#include "smooth/cuda/smoother.hpp"

namespace meshsmooth::detail {

std::vector<BackendInfo> list_cuda_backends() { return {}; }

std::unique_ptr<Smoother> make_cuda_smoother(int) {
  throw NotSupported("BACKEND_NOT_AVAILABLE", "this build has no CUDA");
}

StagingMemory::PageLock cuda_page_lock(std::string_view) { return {}; }

}  // namespace meshsmooth::detail
