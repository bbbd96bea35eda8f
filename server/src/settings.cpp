#include "settings.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <type_traits>
#include <utility>

#include "meshsmooth/backend_name.hpp"

namespace meshsmooth::server {
namespace {

/// A size in bytes, of at least 0: 8GiB is understood.
struct Bytes {};

CLI::Validator text_that(const std::string& what, bool (*fits)(std::string_view),
                         const std::string& choices = "") {
  return {[=](std::string& text) { return fits(text) ? std::string() : "it is not " + what; },
          choices};
}

/// CLI11's own lets "nan" through, which is in no range.
CLI::Validator number_range(double lowest, double highest) {
  const CLI::Range range(lowest, highest);
  return {[range](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::isnan(value)) {
              return text + " is not a number";
            }
            return range(text);
          },
          range.get_description()};
}

CLI::Validator seconds_range() { return number_range(0.0, 1e6); }
CLI::Validator fraction() { return number_range(0.0, 1.0); }

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

bool is_number(std::string_view text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_address(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  return colon != std::string_view::npos && colon > 0 && is_number(text.substr(colon + 1)) &&
         is_printable(text) && text.find_first_of(", ") == std::string_view::npos;
}

bool is_listen_address(std::string_view text) {
  if (text.starts_with("unix:")) return is_printable(text);
  return text.empty() || is_address(text);
}

bool is_socket(std::string_view text) {
  return text.empty() || (text.starts_with("unix:") && is_printable(text));
}

bool is_admin_address(std::string_view text) { return text.empty() || is_address(text); }

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

double to_seconds(ServerConfig::Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

CLI::Option* add_check(CLI::Option* option, const CLI::Validator& validator) {
  return option->check(validator);
}

CLI::Option* add_check(CLI::Option* option, Bytes) {
  // Unlike CLI11's own it leaves what it cannot read as it was.
  const auto read_size = [](std::string& text) {
    std::string number = text;
    std::string problem = CLI::AsSizeValue(false)(number);
    if (problem.empty()) text = number;
    return problem;
  };
  return option->transform(CLI::Validator(read_size, "SIZE"))
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
}

template <class T, class Check>
void add_flag(CLI::App& app, const std::string& flag, T& value, const std::string& text,
              const Check& check) {
  if constexpr (std::is_same_v<T, bool>) {
    app.add_flag(flag, value, text);
  } else if constexpr (std::is_same_v<T, ServerConfig::Duration>) {
    const auto set = [&value](double seconds) {
      value = std::chrono::nanoseconds(std::llround(seconds * 1e9));
    };
    CLI::Option* const option = app.add_option_function<double>(flag, set, text);
    add_check(option, check)->default_str(fmt::format("{}", to_seconds(value)));
  } else {
    add_check(app.add_option(flag, value, text)->capture_default_str(), check);
  }
}

template <class T>
SettingValue value_of(const T& value) {
  if constexpr (std::is_same_v<T, int>) {
    return std::int64_t{value};
  } else if constexpr (std::is_same_v<T, ServerConfig::Duration>) {
    return to_seconds(value);
  } else {
    return value;
  }
}

class Table {
 public:
  /// `check`: a CLI::Validator that describes the range, or `Bytes`.
  template <class T, class Check>
  Table& add(std::string key, T ServerConfig::*member, std::string text, const Check& check) {
    const std::string flag = "--" + key;
    settings_.push_back(
        {std::move(key), std::move(text),
         [flag, member, check](CLI::App& app, ServerConfig& config, const std::string& help) {
           server::add_flag(app, flag, config.*member, help, check);
         },
         [member](const ServerConfig& config) { return value_of(config.*member); }});
    return *this;
  }
  [[nodiscard]] std::vector<Setting> take() { return std::move(settings_); }

 private:
  std::vector<Setting> settings_;
};

using C = ServerConfig;

void add_connections(Table& table) {
  const CLI::Validator none;
  const auto text = text_that("printable", is_printable);
  const auto seconds = seconds_range();
  table
      .add("listen", &C::listen,
           "Address to serve on, HOST:PORT or unix:PATH; port 0 selects a free port, unix: alone "
           "creates a socket in a private folder, removed at exit",
           text_that("HOST:PORT or unix:PATH", is_listen_address))
      .add("admin-listen", &C::admin_listen,
           "Address of /metrics, /healthz and /readyz in plain HTTP, HOST:PORT; empty: none",
           text_that("HOST:PORT", is_admin_address))
      .add("insecure", &C::insecure,
           "Allow an address without TLS that other machines can reach, because something else "
           "protects it",
           none)
      .add("tls-cert", &C::tls_cert, "PEM file with the server's certificate chain; enables TLS",
           text)
      .add("tls-key", &C::tls_key, "PEM file with the private key of the certificate", text)
      .add("tls-client-ca", &C::tls_client_ca,
           "PEM file with certificate authorities; clients must present a certificate signed by "
           "one of them",
           text)
      .add("token-file", &C::token_file,
           "File of lines CALLER:TOKEN or CALLER:sha256:HEX; calls must carry one of the "
           "tokens",
           text)
      .add("credentials-reload-interval-seconds", &C::credentials_reload_interval,
           "Reload interval for certificates and tokens, in seconds", seconds)
      .add("max-metadata-bytes", &C::max_metadata_bytes,
           "Maximum metadata size of a call, in bytes", CLI::Range(1024, 1 << 20))
      .add("max-jobs-per-caller", &C::max_jobs_per_caller,
           "Maximum number of unfinished jobs of one caller; 0: no limit", CLI::Range(0, 1'000'000))
      .add("max-bytes-per-caller", &C::max_bytes_per_caller,
           "Maximum memory reserved for the unfinished jobs of one caller, without their streams, "
           "in bytes; 0: no limit",
           Bytes())
      .add("max-caller-memory-share", &C::max_caller_memory_share,
           "Fraction of host and device memory that the unfinished jobs of one caller may reserve "
           "together; a single job may exceed it",
           fraction())
      .add("interactive-callers", &C::interactive_callers,
           "Callers whose jobs may have the priority INTERACTIVE, separated by commas; all: every "
           "caller; the jobs of others are NORMAL then",
           text);
}

void add_devices(Table& table) {
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

void add_limits(Table& table) {
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
           "Number of complete jobs waiting for a lane from which on new jobs are refused",
           CLI::Range(1, 1'000'000))
      .add("max-queued-bytes", &C::max_queued_bytes,
           "Mesh size of the waiting jobs from which on new jobs are refused, in bytes; 0: the "
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
      .add("region-socket", &C::region_socket,
           "Unix socket by which callers on this host and of this user get shared memory, "
           "unix:PATH; unix: alone creates a socket in a private folder, removed at exit; empty: "
           "no shared memory",
           text_that("unix:PATH", is_socket))
      .add("max-region-bytes", &C::max_region_bytes,
           "Memory shared with callers on this host, in bytes; 0: a quarter of the host memory "
           "limit",
           bytes)
      .add("region-idle-timeout-seconds", &C::region_idle_timeout,
           "Time after which shared memory that no job used is asked back, in seconds", seconds);
}

void add_times(Table& table) {
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

void add_streams(Table& table) {
  const auto seconds = seconds_range();
  const auto message_bytes = CLI::Range(4096, 1 << 30);
  table
      .add("early-data-bytes", &C::early_data_bytes,
           "Advice to clients: maximum data to send before the job is accepted, in bytes",
           CLI::Range(0, 1 << 22))
      .add("max-chunk-bytes", &C::max_chunk_bytes,
           "Advice to clients: maximum chunk size, in bytes", message_bytes)
      .add("result-chunk-bytes", &C::result_chunk_bytes, "Chunk size of results, in bytes",
           message_bytes)
      // Clients send chunks of 1 MiB, whatever is set.
      .add("max-receive-message-bytes", &C::max_receive_message_bytes,
           "Maximum size of a received message, in bytes", CLI::Range(2 << 20, 1 << 30))
      .add("stream-window-bytes", &C::stream_window_bytes,
           "Flow-control window of a stream, in bytes; 0: adapts to the network",
           CLI::Range(0, 1 << 30))
      .add("max-concurrent-streams", &C::max_concurrent_streams,
           "Maximum number of concurrent calls per connection", CLI::Range(1, 1'000'000))
      .add("keepalive-time-seconds", &C::keepalive_time,
           "Idle time after which a connection is pinged, in seconds", seconds)
      .add("keepalive-timeout-seconds", &C::keepalive_timeout,
           "Time to wait for the answer to a ping before closing the connection, in seconds",
           seconds)
      .add("min-client-ping-interval-seconds", &C::min_client_ping_interval,
           "Minimum interval between pings of a client; clients that ping more often are "
           "disconnected, in seconds",
           seconds)
      .add("max-connection-age-seconds", &C::max_connection_age,
           "Age from which on a connection takes no new calls, in seconds; 0: no limit", seconds);
}

}  // namespace

const std::vector<Setting>& settings() {
  static const std::vector<Setting> table = [] {
    Table all;
    add_connections(all);
    add_devices(all);
    add_limits(all);
    add_times(all);
    add_streams(all);
    all.add("log-level", &C::log_level, "Log level: debug, info, warn, error or off",
            CLI::Validator(CLI::IsMember({"debug", "info", "warn", "error", "off"})))
        .add("log-format", &C::log_format, "Log format: text or json",
             CLI::Validator(CLI::IsMember({"text", "json"})));
    return all.take();
  }();
  return table;
}

}  // namespace meshsmooth::server
