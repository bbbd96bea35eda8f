#pragma once

#include <cstdint>

namespace meshsmooth::server {

/// Bytes of memory that this process may use at most: of the machine or of its
/// control group (version 2, or 1), whichever is less.
[[nodiscard]] std::int64_t available_host_bytes();

}  // namespace meshsmooth::server
