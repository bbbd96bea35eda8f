#pragma once

#include <cstdint>
#include <memory_resource>

namespace meshsmooth::server {

/// Where meshes live: large blocks straight from the kernel, on huge pages
/// where it has them, and back to it at once. malloc would keep them in the
/// arena of whichever thread freed them, beyond what the ledger counts.
/// Thread-safe; lives for ever.
[[nodiscard]] std::pmr::memory_resource* host_memory();

/// What of the heap stays, free, when messages have gone.
inline constexpr std::int64_t kKeptHeapBytes = 128 << 20;

/// For a process that serves: messages and working memory stay warm in the heap
/// instead of going back to the kernel with every job, up to 1.7 times the
/// throughput of uploads. Call it first of all.
void keep_heap_warm();

}  // namespace meshsmooth::server
