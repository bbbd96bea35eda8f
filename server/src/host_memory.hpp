#pragma once

#include <memory_resource>

namespace meshsmooth::server {

/// Where meshes live: large blocks straight from the kernel, on huge pages
/// where it has them, and back to it at once. malloc would keep them in the
/// arena of whichever thread freed them, beyond what the ledger counts.
/// Thread-safe; lives for ever.
[[nodiscard]] std::pmr::memory_resource* host_memory();

}  // namespace meshsmooth::server
