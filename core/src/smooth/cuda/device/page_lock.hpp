#pragma once

#include <string_view>

#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::detail {

/// Locks pages for a device; without `lock` where `backend` is no CUDA device.
[[nodiscard]] StagingMemory::PageLock cuda_page_lock(std::string_view backend);

}  // namespace meshsmooth::detail
