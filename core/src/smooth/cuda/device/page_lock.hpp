#pragma once

#include <string_view>

#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::detail {

/// Page-locks memory for a device; without `lock` if `backend` is not a CUDA device.
[[nodiscard]] StagingMemory::PageLock cuda_page_lock(std::string_view backend);

}  // namespace meshsmooth::detail
