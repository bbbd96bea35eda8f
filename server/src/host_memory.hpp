#pragma once

#include <cstdint>
#include <memory_resource>

namespace meshsmooth::server {

/// Memory for meshes: large blocks are mapped from the kernel, on huge pages where available, and
/// returned to it at once. malloc would keep them in the arena of whichever thread freed them,
/// beyond what the memory budget counts. Thread-safe; never destroyed.
[[nodiscard]] std::pmr::memory_resource* host_memory();

/// Free heap memory that is retained between messages.
inline constexpr std::int64_t kKeptHeapBytes = 128 << 20;

/// For a server process: keeps messages and working memory in the heap instead of returning them
/// to the kernel with every job; up to 1.7 times the upload throughput. Call it before anything
/// else.
void keep_heap_warm();

}  // namespace meshsmooth::server
