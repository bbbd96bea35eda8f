#pragma once

#include <cstdint>
#include <filesystem>

namespace meshsmooth::server {

inline constexpr const char* kControlGroup = "/sys/fs/cgroup";

/// Bytes of memory that this process may use at most: of the machine or of its
/// control group (version 2, or 1), whichever is less. A limit that cannot be read is none.
[[nodiscard]] std::int64_t available_host_bytes(const std::filesystem::path& group = kControlGroup);

/// Cores on which it may run at the same time: those of its affinity, or what the quota of its
/// control group comes to, rounded up, whichever is less. At least 1.
[[nodiscard]] int available_cores(const std::filesystem::path& group = kControlGroup);

}  // namespace meshsmooth::server
