#include "settings.hpp"

#include <charconv>
#include <set>

#include "meshsmooth/backend_name.hpp"
#include "setting_table.hpp"

namespace meshsmooth::server {
namespace {

using C = ServerConfig;

bool is_socket(std::string_view text) {
  return text.empty() || (text.starts_with("unix:") && is_printable(text));
}

bool is_backend(std::string_view text) { return parse_backend_name(text).has_value(); }

bool is_device_list(std::string_view text) {
  if (text == "all") return true;
  std::set<int> seen;
  while (!text.empty()) {
    const std::string_view number = text.substr(0, text.find(','));
    int device = 0;
    const auto [end, error] = std::from_chars(number.begin(), number.end(), device);
    if (error != std::errc() || end != number.end() || !seen.insert(device).second) return false;
    if (number.size() + 1 == text.size()) return false;  // it ends in a comma
    text.remove_prefix(std::min(number.size() + 1, text.size()));
  }
  return !seen.contains(-1) && (seen.empty() || *seen.begin() >= 0);
}

}  // namespace

void add_device_settings(Table& table) {
  table
      .add("backend", &C::backend,
           "Backend: " + backend_name_list(true) + "; auto: the first GPU that works, else the CPU",
           text_that("one of " + backend_name_list(true), is_backend, "{auto,cpu,cuda}"))
      .add("devices", &C::devices,
           "GPUs to use: all, or numbers as in 0,2; empty: the device of the backend",
           text_that("all, or numbers of GPUs as in 0,2, each once", is_device_list))
      .add("lanes", &C::lanes,
           "Number of jobs that run concurrently on each device; 0: 4 on CUDA, on the CPU a "
           "quarter of the cores, from 2 to 8",
           CLI::Range(0, 1024))
      .add("reserved-lanes", &C::reserved_lanes,
           "Number of further lanes of each device, for callers without a running job while all "
           "other lanes are busy",
           CLI::Range(0, 1024))
      .add("threads-per-lane", &C::threads_per_lane,
           "Maximum number of threads of a job; 0: all available cores, shared by concurrent jobs",
           CLI::Range(0, 4096));
}

void add_limit_settings(Table& table) {
  const Bytes bytes;
  const auto seconds = seconds_range();
  const auto counts = CLI::Range(std::int64_t{1}, std::int64_t{INT32_MAX});
  table
      .add("host-memory-limit-bytes", &C::host_memory_limit_bytes,
           "Host memory for all jobs, in bytes; 0: 80 % of what machine and control group allow",
           bytes)
      .add("device-bytes", &C::device_bytes,
           "Memory of each device for all jobs, in bytes; 0: what is free at the start, less a "
           "margin",
           bytes)
      .add("idle-pinned-bytes", &C::idle_pinned_bytes,
           "Mesh memory kept for the next jobs, page-locked for GPUs, in bytes; 0: 1/16 of the "
           "host memory limit, at most 1 GiB",
           bytes)
      .add("max-job-bytes", &C::max_job_bytes,
           "Maximum host memory of one job, in bytes; 0: 7/8 of the host memory limit", bytes)
      .add("max-node-count", &C::max_node_count, "Maximum number of nodes of a mesh", counts)
      .add("max-element-count", &C::max_element_count, "Maximum number of elements of a mesh",
           counts)
      .add("max-queued-jobs", &C::max_queued_jobs,
           "Maximum number of complete jobs waiting for a lane; further jobs are refused",
           CLI::Range(1, 1'000'000))
      .add("max-queued-bytes", &C::max_queued_bytes,
           "Maximum mesh size of the waiting jobs, in bytes; further jobs are refused; 0: the "
           "host memory limit",
           bytes)
      .add("max-kept-jobs", &C::max_kept_jobs, "Number of ended jobs that ListJobs still returns",
           CLI::Range(0, 1'000'000))
      .add("max-result-ttl-seconds", &C::max_result_ttl,
           "Maximum time for which a result is kept on request, in seconds", seconds)
      .add("max-kept-result-bytes", &C::max_kept_result_bytes,
           "Memory for kept results, of which the oldest are dropped first, in bytes; 0: a quarter "
           "of the host memory limit",
           bytes)
      .add("max-topology-bytes", &C::max_topology_bytes,
           "Memory for cached topologies, of host and devices together, in bytes; 0: a quarter of "
           "the host memory limit",
           bytes)
      .add("shared-memory-socket", &C::shared_memory_socket,
           "Unix socket by which callers on this host and of this user get shared memory, "
           "unix:PATH; unix: alone creates a socket in a private folder, removed at exit; empty: "
           "no shared memory",
           text_that("unix:PATH", is_socket))
      .add("max-shared-memory-bytes", &C::max_shared_memory_bytes,
           "Memory shared with callers on this host, in bytes; 0: a quarter of the host memory "
           "limit",
           bytes)
      .add("shared-memory-idle-timeout-seconds", &C::shared_memory_idle_timeout,
           "Time after which shared memory that no job used is recalled, in seconds", seconds);
}

void add_time_settings(Table& table) {
  const CLI::Validator none;
  const auto seconds = seconds_range();
  table
      .add("priority-ageing-seconds", &C::priority_ageing,
           "Waiting time after which a job gains one priority level, in seconds; 0: never", seconds)
      .add("max-queue-timeout-seconds", &C::max_queue_timeout,
           "Maximum waiting time in the queue, in seconds", seconds)
      .add("max-job-seconds", &C::max_job_time,
           "Maximum running time of a job, in seconds; 0: no limit", seconds)
      .add("stream-idle-timeout-seconds", &C::stream_idle_timeout,
           "Maximum pause of an upload, or of a client that does not read, in seconds", seconds)
      .add("min-upload-bytes-per-second", &C::min_upload_bytes_per_second,
           "Minimum rate of an upload, in bytes per second; 0: no minimum", Bytes())
      .add("upload-rate-window-seconds", &C::upload_rate_window,
           "Time by which an upload may fall behind the minimum rate, in seconds; must suffice for "
           "a chunk of 1 MiB",
           seconds)
      .add("max-upload-seconds", &C::max_upload_time,
           "Time for an upload of any size, in seconds: its minimum rate is at least its size "
           "divided by this; 0: no limit",
           seconds)
      .add("max-connection-upload-share", &C::max_connection_upload_share,
           "Fraction of host and device memory that the unfinished uploads of one TCP connection "
           "may reserve together; a single upload may exceed it",
           fraction())
      .add("drop-timeout-seconds", &C::drop_timeout,
           "Time for a refused client to stop sending, in seconds", seconds)
      .add("lame-duck-seconds", &C::lame_duck,
           "Time after SIGTERM for which the server is not ready but still accepts jobs, in "
           "seconds",
           seconds)
      .add("drain-grace-seconds", &C::drain_grace,
           "Time after the lame duck period for running jobs to finish, in seconds", seconds)
      .add("exit-with-stdin", &C::exit_with_stdin,
           "Stop at once when standard input ends: with a pipe as standard input the server ends "
           "together with the process that started it, however that ends",
           none)
      .add("lane-watchdog-seconds", &C::lane_watchdog,
           "Time for a running job to stop on request before its lane counts as lost, in seconds",
           seconds)
      .add("warm-up", &C::warm_up,
           "Run tiny jobs on each lane before the server is ready; --warm-up=false disables it",
           none);
}

const std::vector<Setting>& settings() {
  static const std::vector<Setting> table = [] {
    Table all;
    add_connection_settings(all);
    add_device_settings(all);
    add_limit_settings(all);
    add_time_settings(all);
    add_stream_settings(all);
    all.add("log-level", &C::log_level, "Log level: debug, info, warn, error or off",
            CLI::Validator(CLI::IsMember({"debug", "info", "warn", "error", "off"})))
        .add("log-format", &C::log_format, "Log format: text or json",
             CLI::Validator(CLI::IsMember({"text", "json"})));
    return all.take();
  }();
  return table;
}

}  // namespace meshsmooth::server
