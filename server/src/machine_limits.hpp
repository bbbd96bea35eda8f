#pragma once

#include <cstdint>
#include <filesystem>

namespace meshsmooth::server {

/// Where the kernel publishes the limits of a process: control groups of containers, services and
/// batch jobs.
struct ControlGroups {
  std::filesystem::path root = "/sys/fs/cgroup";
  std::filesystem::path memberships = "/proc/self/cgroup";
};

/// The memory that this process may use, in bytes: the least of the machine's memory and the limits
/// of its control group and all parent groups (version 2 or 1). Unreadable limits are ignored.
[[nodiscard]] std::int64_t available_host_bytes(const ControlGroups& groups = {});

/// The number of cores that it may use: the least of its affinity and the quotas of those groups,
/// rounded up. At least 1.
[[nodiscard]] int available_cores(const ControlGroups& groups = {});

}  // namespace meshsmooth::server
