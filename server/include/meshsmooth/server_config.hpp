#pragma once

#include <cstdint>
#include <string>

namespace meshsmooth::server {

/// Every setting of the server with its unit and default. The ranges stand with
/// the flags in src/config.cpp.
struct ServerConfig {
  std::string listen = "127.0.0.1:50051";  // HOST:PORT, unix:PATH; empty: in-process only
  std::string admin_listen = "";           // HOST:PORT of /metrics, /healthz, /readyz; empty: none

  bool insecure = false;      // may be in clear though others reach `listen`
  std::string tls_cert = "";  // PEM files; with a certificate it is TLS
  std::string tls_key = "";
  std::string tls_client_ca = "";  // set: clients must show a certificate that these have signed
  std::string token_file = "";     // set: calls must carry a token that is in it
  double credentials_reload_interval_seconds = 10;
  int max_metadata_bytes = 8 * 1024;
  int max_jobs_per_identity = 0;            // that live; 0: no limit
  std::int64_t max_bytes_per_identity = 0;  // promised to those; 0: no limit

  std::string backend = "auto";
  std::string devices = "";  // GPUs: "all", or by number, "0,2"; empty: the one of `backend`
  /// Jobs that run at the same time on each device; 0: 4 on CUDA; on the CPU a quarter of the
  /// cores, at least 2 (if there are 2) and at most 8.
  int lanes = 0;
  /// Of a job at most. 0: all cores that affinity and control group allow; jobs that run at the
  /// same time share them.
  int threads_per_lane = 0;

  std::int64_t host_memory_limit_bytes = 0;  // 0: 80 % of what machine and cgroup allow
  std::int64_t device_bytes = 0;  // of each device, for all jobs; 0: what is free, less a margin
  /// Page-locked memory that waits for the next jobs' meshes; 0: a 16th of the
  /// host memory limit, at most 1 GiB. Larger arrays are not locked. CUDA only,
  /// beside the host memory limit.
  std::int64_t idle_pinned_bytes = 0;
  std::int64_t max_job_bytes = 0;  // all that one job needs; 0: the host memory limit
  std::int64_t max_node_count = INT32_MAX;
  std::int64_t max_element_count = INT32_MAX;
  int max_queued_jobs = 100;          // complete, not yet running; then new ones are refused
  std::int64_t max_queued_bytes = 0;  // mesh bytes of those; 0: the host memory limit
  int max_kept_jobs = 1000;           // ended jobs that ListJobs still knows

  double max_result_ttl_seconds = 3600;    // of results that outlive their call
  std::int64_t max_kept_result_bytes = 0;  // of all those; 0: a quarter of the host memory limit
  /// Topologies that jobs can name, with what is prepared of them; the least recently used go
  /// first, and whenever their memory is needed. 0: a quarter of the host memory limit.
  std::int64_t max_topology_bytes = 0;

  /// A job that has waited so long counts as one priority higher; 0: never.
  double priority_ageing_seconds = 60;
  double max_queue_timeout_seconds = 3600;
  double stream_idle_timeout_seconds = 60;  // between two chunks of an upload
  /// Slower uploads are ended. An upload may fall behind by what this rate transfers in
  /// `upload_rate_window_seconds`, which must suffice for a chunk. 0: no minimum.
  std::int64_t min_upload_bytes_per_second = 32 * 1024;
  double upload_rate_window_seconds = 40;
  /// Fraction of the host memory limit, and of the device memory, that the unfinished uploads of
  /// one TCP connection may reserve together. One upload may always have more.
  double max_connection_upload_share = 0.25;
  double drop_timeout_seconds = 1;  // after StopSending, until half-close
  double lame_duck_seconds = 5;     // not serving, but still accepting
  double drain_grace_seconds = 30;  // for the running jobs, after that

  /// A lane that does not let go of a job so long after it was asked to: the server is broken.
  double lane_watchdog_seconds = 30;
  bool warm_up = true;  // each lane runs tiny jobs before the server says SERVING

  int early_data_bytes = 64 * 1024;
  int max_chunk_bytes = 2 * 1024 * 1024;
  int result_chunk_bytes = 1 << 20;
  int max_receive_message_bytes = 4 * 1024 * 1024;
  /// HTTP/2 flow-control window of a stream; 0: gRPC adapts it to the network.
  /// A fixed window bounds the memory of many uploads (64 uploads of 32 MiB:
  /// 0.3 instead of 2 GiB) but costs 15-26 % on loopback and a factor of 4 at
  /// 5 ms round trip.
  int stream_window_bytes = 0;
  int max_concurrent_streams = 128;  // per connection
  double keepalive_time_seconds = 60;
  double keepalive_timeout_seconds = 20;
  double min_client_ping_interval_seconds = 15;
  double max_connection_age_seconds = 3600;  // 0: for ever; running calls are never cut

  std::string log_level = "info";   // debug, info, warn, error, off
  std::string log_format = "text";  // text, json
};

}  // namespace meshsmooth::server
