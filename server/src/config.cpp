#include "config.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <limits>

namespace meshsmooth::server {
namespace {

std::string environment_name(std::string flag) {
  std::transform(flag.begin(), flag.end(), flag.begin(), [](unsigned char c) {
    return c == '-' ? '_' : static_cast<char>(std::toupper(c));
  });
  return "MESHSMOOTH" + flag.substr(1);  // "__LANES" -> "_LANES"
}

}  // namespace

void add_options(CLI::App& app, ServerConfig& config) {
  const auto add = [&app](const std::string& flag, auto& value, const std::string& text) {
    return app.add_option(flag, value, text)
        ->capture_default_str()
        ->envname(environment_name(flag));
  };
  const auto any_bytes = CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  const auto size = CLI::AsSizeValue(false);
  const auto seconds = CLI::Range(0.0, 1e6);
  const auto message_bytes = CLI::Range(4096, 1 << 30);
  const auto counts = CLI::Range(std::int64_t{1}, std::int64_t{INT32_MAX});

  add("--listen", config.listen, "HOST:PORT or unix:PATH to serve on; port 0 picks one");
  add("--backend", config.backend, "auto, cpu, cuda or cuda:N");
  add("--lanes", config.lanes, "Jobs that run at the same time; 0: 4 on CUDA, 1 on the CPU")
      ->check(CLI::Range(0, 1024));
  add("--threads-per-lane", config.threads_per_lane, "0: all cores shared by the lanes")
      ->check(CLI::Range(0, 4096));

  add("--host-memory-limit-bytes", config.host_memory_limit_bytes,
      "Memory for all jobs, 8GiB is understood; 0: 80 % of what machine and cgroup allow")
      ->transform(size)
      ->check(any_bytes);
  add("--device-bytes", config.device_bytes,
      "Device memory for all jobs, at most; 0: what is free at the start, less a margin")
      ->transform(size)
      ->check(any_bytes);
  add("--idle-pinned-bytes", config.idle_pinned_bytes,
      "Page-locked memory kept for the next jobs; 0: 1/16 of the host memory limit, at most 1 GiB")
      ->transform(size)
      ->check(any_bytes);
  add("--max-job-bytes", config.max_job_bytes, "Memory for one job; 0: the host memory limit")
      ->transform(size)
      ->check(any_bytes);
  add("--max-node-count", config.max_node_count, "Nodes of one mesh")->check(counts);
  add("--max-element-count", config.max_element_count, "Elements of one mesh")->check(counts);
  add("--max-queued-jobs", config.max_queued_jobs, "Jobs admitted but not yet running")
      ->check(CLI::Range(1, 1'000'000));
  add("--max-queued-bytes", config.max_queued_bytes,
      "Mesh bytes of those jobs; 0: the host memory limit")
      ->transform(size)
      ->check(any_bytes);
  add("--max-kept-jobs", config.max_kept_jobs, "Ended jobs that ListJobs still knows")
      ->check(CLI::Range(0, 1'000'000));

  add("--max-result-ttl-seconds", config.max_result_ttl_seconds,
      "Longest that a result is kept for a caller who asks for it")
      ->check(seconds);
  add("--max-kept-result-bytes", config.max_kept_result_bytes,
      "Positions kept so, the oldest go first; 0: a quarter of the host memory limit")
      ->transform(size)
      ->check(any_bytes);

  add("--max-queue-timeout-seconds", config.max_queue_timeout_seconds, "Longest wait in the queue")
      ->check(seconds);
  add("--stream-idle-timeout-seconds", config.stream_idle_timeout_seconds,
      "Longest pause within an upload")
      ->check(seconds);
  add("--drop-timeout-seconds", config.drop_timeout_seconds,
      "How long a refused client may take to stop sending")
      ->check(seconds);
  add("--lame-duck-seconds", config.lame_duck_seconds,
      "On SIGTERM: not serving by health, but still accepting")
      ->check(seconds);
  add("--drain-grace-seconds", config.drain_grace_seconds,
      "After that: for the running jobs to finish")
      ->check(seconds);

  add("--early-data-bytes", config.early_data_bytes,
      "What clients may send before they are accepted")
      ->check(CLI::Range(0, 1 << 22));
  add("--max-chunk-bytes", config.max_chunk_bytes, "Largest chunk clients should send")
      ->check(message_bytes);
  add("--result-chunk-bytes", config.result_chunk_bytes, "Size of the chunks sent")
      ->check(message_bytes);
  add("--max-receive-message-bytes", config.max_receive_message_bytes,
      "Larger messages end the call")
      ->check(message_bytes);
  add("--stream-window-bytes", config.stream_window_bytes,
      "Flow-control window of a stream; 0: adapts to the network")
      ->check(CLI::Range(0, 1 << 30));
  add("--max-concurrent-streams", config.max_concurrent_streams, "Calls per connection")
      ->check(CLI::Range(1, 1'000'000));
  add("--keepalive-time-seconds", config.keepalive_time_seconds, "Ping a silent connection after")
      ->check(seconds);
  add("--keepalive-timeout-seconds", config.keepalive_timeout_seconds,
      "Close it when the ping is not answered within")
      ->check(seconds);
  add("--min-client-ping-interval-seconds", config.min_client_ping_interval_seconds,
      "Clients that ping more often are sent away")
      ->check(seconds);
  add("--max-connection-age-seconds", config.max_connection_age_seconds,
      "Connections take no new calls after; 0: never")
      ->check(seconds);

  add("--log-level", config.log_level, "debug, info, warn, error or off")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}));
}

std::string describe(const ServerConfig& config, char separator) {
  CLI::App app;
  ServerConfig copy = config;
  add_options(app, copy);
  std::string text = app.config_to_str(true, false);
  if (!text.ends_with('\n')) text += '\n';
  std::replace(text.begin(), text.end(), '\n', separator);
  return text;
}

}  // namespace meshsmooth::server
