#pragma once

#include <cstdint>

namespace meshsmooth::server {

/// Resource usage of this process. 0 where the kernel does not report it.
struct ProcessStats {
  std::int64_t resident_bytes = 0;
  double cpu_seconds = 0;
  std::int64_t open_descriptors = 0;
  std::int64_t threads = 0;
};

[[nodiscard]] ProcessStats process_stats();

}  // namespace meshsmooth::server
