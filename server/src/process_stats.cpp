#include "process_stats.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace meshsmooth::server {
namespace {

std::int64_t entry_count(const char* folder) {
  std::error_code error;
  const std::filesystem::directory_iterator entries(folder, error);
  return error ? 0 : std::distance(begin(entries), end(entries));
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ProcessStats process_stats() {
  ProcessStats stats;
  std::ifstream memory("/proc/self/statm");
  std::int64_t total_pages = 0, resident_pages = 0;
  if (memory >> total_pages >> resident_pages) {
    stats.resident_bytes = resident_pages * sysconf(_SC_PAGESIZE);
  }
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) {
    stats.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  stats.open_descriptors = entry_count("/proc/self/fd");
  stats.threads = entry_count("/proc/self/task");
  return stats;
}

}  // namespace meshsmooth::server
