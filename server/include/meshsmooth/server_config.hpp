#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "meshsmooth/trace_settings.hpp"

namespace meshsmooth::server {

/// Every setting of the server with its default. Sizes are bytes. Flags, environment and files
/// give durations in seconds. Meanings and ranges are in src/settings.hpp.
struct ServerConfig {
  using Duration = std::chrono::nanoseconds;

  std::string listen = "127.0.0.1:50051";  // empty: in-process only
  std::string admin_listen = "";           // empty: no admin port

  bool insecure = false;
  bool behind_proxy = false;
  bool i_accept_old_grpc = false;
  std::string tls_cert = "";
  std::string tls_key = "";
  std::string tls_client_ca = "";
  std::string token_file = "";
  Duration credentials_reload_interval = std::chrono::seconds(10);
  int max_metadata_bytes = 8 * 1024;
  int max_jobs_per_caller = 0;            // 0: no limit
  std::int64_t max_bytes_per_caller = 0;  // 0: no limit
  double max_caller_memory_share = 0.875;
  std::string interactive_callers = "";  // "all", or names

  std::string backend = "auto";
  std::string devices = "";  // empty: the device of `backend`
  int lanes = 0;             // 0: depends on the backend
  int reserved_lanes = 1;
  int threads_per_lane = 0;  // 0: all available cores

  std::int64_t host_memory_limit_bytes = 0;  // 0: 80 % of what machine and control group allow
  std::int64_t device_bytes = 0;             // 0: what is free at the start, less a margin
  std::int64_t idle_pinned_bytes = 0;        // 0: 1/16 of the host memory limit, at most 1 GiB
  std::int64_t max_job_bytes = 0;            // 0: 7/8 of the host memory limit
  std::int64_t max_node_count = INT32_MAX;
  std::int64_t max_element_count = INT32_MAX;
  int max_queued_jobs = 100;
  std::int64_t max_queued_bytes = 0;  // 0: the host memory limit
  int max_kept_jobs = 1000;

  Duration max_result_ttl = std::chrono::hours(1);
  std::int64_t max_kept_result_bytes = 0;  // 0: a quarter of the host memory limit
  std::int64_t max_topology_bytes = 0;     // 0: a quarter of the host memory limit

  std::string shared_memory_socket = "unix:";  // empty: no shared memory
  std::int64_t max_shared_memory_bytes = 0;    // 0: a quarter of the host memory limit
  Duration shared_memory_idle_timeout = std::chrono::minutes(5);

  Duration priority_ageing = std::chrono::seconds(60);  // 0: never
  Duration max_queue_timeout = std::chrono::hours(1);
  Duration max_job_time = std::chrono::hours(1);  // 0: no limit
  Duration stream_idle_timeout = std::chrono::seconds(60);
  std::int64_t min_upload_bytes_per_second = 32 * 1024;  // 0: no minimum
  Duration upload_rate_window = std::chrono::seconds(40);
  Duration max_upload_time = std::chrono::minutes(10);  // 0: no limit
  double max_connection_upload_share = 0.25;
  Duration drop_timeout = std::chrono::seconds(1);
  Duration lame_duck = std::chrono::seconds(5);
  Duration drain_grace = std::chrono::seconds(30);
  bool exit_with_stdin = false;  // of the program only

  Duration lane_watchdog = std::chrono::seconds(30);
  bool warm_up = true;

  int early_data_bytes = 64 * 1024;
  int max_chunk_bytes = 2 * 1024 * 1024;
  int result_chunk_bytes = 1 << 20;
  int max_receive_message_bytes = 4 * 1024 * 1024;
  /// 0: gRPC adapts it to the network. A fixed window bounds the memory of many uploads
  /// (64 uploads of 32 MiB: 0.3 instead of 2 GiB), but costs 15-26 % of the throughput on loopback
  /// and a factor of 4 at a round trip of 5 ms.
  int stream_window_bytes = 0;
  int max_concurrent_streams = 128;
  int max_connections = 4096;
  int max_connections_per_address = 1024;
  Duration keepalive_time = std::chrono::seconds(60);
  Duration keepalive_timeout = std::chrono::seconds(20);
  Duration min_client_ping_interval = std::chrono::seconds(15);
  Duration max_connection_age = std::chrono::hours(1);      // 0: no limit
  Duration max_connection_idle = std::chrono::minutes(10);  // 0: no limit

  std::string log_level = "info";   // debug, info, warn, error, off
  std::string log_format = "text";  // text, json

  TraceSettings traces = {};  // of the variables OTEL_…; the others are settings of our own
};

}  // namespace meshsmooth::server
