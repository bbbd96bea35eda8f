#pragma once

#include <cstdint>
#include <filesystem>

namespace meshsmooth::server {

/// Where the kernel says what limits a process: containers, services and batch jobs have groups.
struct ControlGroups {
  std::filesystem::path root = "/sys/fs/cgroup";
  std::filesystem::path memberships = "/proc/self/cgroup";
};

/// Bytes of memory that this process may use at most: of the machine, or of its control group and
/// all that is part of (version 2, or 1), whichever is least. A limit that cannot be read is none.
[[nodiscard]] std::int64_t available_host_bytes(const ControlGroups& groups = {});

/// Cores on which it may run at the same time: those of its affinity, or what the quotas of those
/// groups come to, rounded up, whichever is least. At least 1.
[[nodiscard]] int available_cores(const ControlGroups& groups = {});

}  // namespace meshsmooth::server
