#include "machine_limits.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <thread>

namespace meshsmooth::server {
namespace {

// None also where the kernel writes "max", or -1.
std::optional<std::int64_t> read_limit(std::istream& file) {
  std::int64_t limit = 0;
  if (file >> limit && limit > 0) return limit;
  return std::nullopt;
}

}  // namespace

// Inside a container its own group is mounted as the root.

std::int64_t available_host_bytes(const std::filesystem::path& group) {
  std::int64_t bytes = std::int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
  for (const char* name : {"memory.max", "memory/memory.limit_in_bytes"}) {
    std::ifstream file(group / name);
    bytes = std::min(bytes, read_limit(file).value_or(bytes));
  }
  return bytes;
}

int available_cores(const std::filesystem::path& group) {
  std::int64_t cores = std::max(1U, std::thread::hardware_concurrency());
  const auto limit = [&](std::istream& quota_file, std::istream& period_file) {
    const auto quota = read_limit(quota_file);
    const auto period = read_limit(period_file);
    if (quota && period) cores = std::min(cores, (*quota + *period - 1) / *period);
  };
  std::ifstream both(group / "cpu.max");
  limit(both, both);
  std::ifstream quota(group / "cpu" / "cpu.cfs_quota_us"),
      period(group / "cpu" / "cpu.cfs_period_us");
  limit(quota, period);
  return static_cast<int>(cores);
}

}  // namespace meshsmooth::server
