#include "machine_limits.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace meshsmooth::server {
namespace {

// Nothing for "max" and -1, the kernel's values for no limit.
std::optional<std::int64_t> read_limit(std::istream& file) {
  std::int64_t limit = 0;
  if (file >> limit && limit > 0) return limit;
  return std::nullopt;
}

// Folders that may have limits of a controller: of the process's own group and all its parents. In
// a container the root is the process's own group.
std::vector<std::filesystem::path> folders(const ControlGroups& groups,
                                           const std::string& controller) {
  const std::filesystem::path first_version = groups.root / controller;
  std::vector<std::filesystem::path> found = {groups.root, first_version};
  std::ifstream memberships(groups.memberships);
  for (std::string line; std::getline(memberships, line);) {  // 4:cpu,cpuacct:/a/b
    const std::size_t names = line.find(':') + 1, path = line.find(':', names) + 1;
    if (names == 0 || path == 0) continue;
    const std::string controllers = "," + line.substr(names, path - names - 1) + ",";
    const bool second = controllers == ",,";
    if (!second && controllers.find("," + controller + ",") == std::string::npos) continue;
    std::filesystem::path below = std::filesystem::path(line.substr(path)).relative_path();
    for (; !below.empty(); below = below.parent_path()) {
      found.push_back((second ? groups.root : first_version) / below);
    }
  }
  return found;
}

}  // namespace

std::int64_t available_host_bytes(const ControlGroups& groups) {
  std::int64_t bytes = std::int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
  for (const auto& folder : folders(groups, "memory")) {
    for (const char* name : {"memory.max", "memory.limit_in_bytes"}) {
      std::ifstream file(folder / name);
      bytes = std::min(bytes, read_limit(file).value_or(bytes));
    }
  }
  return bytes;
}

int available_cores(const ControlGroups& groups) {
  std::int64_t cores = std::max(1U, std::thread::hardware_concurrency());
  const auto limit = [&](std::istream& quota_file, std::istream& period_file) {
    const auto quota = read_limit(quota_file);
    const auto period = read_limit(period_file);
    if (quota && period) cores = std::min(cores, (*quota + *period - 1) / *period);
  };
  for (const auto& folder : folders(groups, "cpu")) {
    std::ifstream both(folder / "cpu.max");
    limit(both, both);
    std::ifstream quota(folder / "cpu.cfs_quota_us"), period(folder / "cpu.cfs_period_us");
    limit(quota, period);
  }
  return static_cast<int>(cores);
}

}  // namespace meshsmooth::server
