#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/error_reason.hpp"
#include "meshsmooth/job_state.hpp"
#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::v1 {
class Summary;
}

namespace meshsmooth::client {

using meshsmooth::job_state_name;
using meshsmooth::JobState;
using meshsmooth::StatusCode;

/// A call failed. `reason()` is the server's ErrorInfo.reason, or "" when the
/// error did not come from a meshsmooth server; `hint()` then says what such an
/// error usually means and what to do.
class ServiceError : public Error {
 public:
  ServiceError(StatusCode code, std::string reason, const std::string& message,
               ErrorDetails details, std::string hint,
               std::optional<std::chrono::nanoseconds> retry_delay = {})
      : Error(std::move(reason), message, std::move(details)),
        code_(code),
        hint_(std::move(hint)),
        retry_delay_(retry_delay) {}
  [[nodiscard]] StatusCode code() const noexcept { return code_; }
  [[nodiscard]] const std::string& hint() const noexcept { return hint_; }
  /// The same request may do better after this time; unset: it will not.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> retry_delay() const noexcept {
    return retry_delay_;
  }

 private:
  StatusCode code_;
  std::string hint_;
  std::optional<std::chrono::nanoseconds> retry_delay_;
};

struct JobProgress {
  JobState state = JobState::unspecified;
  int queue_position = 0;
  std::string stage;  // "find_neighbours", "iterate", …; empty unless running
  int iteration = 0;
  double max_displacement = 0;
  double rms_displacement = 0;
};

struct RequestOptions {
  std::string request_id;        // a UUID; empty: one is made
  std::string backend = "auto";  // "auto", "cpu", "cuda"
  /// Deadline of the whole call. When unset: 10 minutes, plus 1 s for every MB
  /// of the mesh, plus 10 us for every element and allowed iteration; at most a
  /// week.
  std::optional<std::chrono::nanoseconds> timeout;
  std::chrono::milliseconds progress_interval{100};
  std::function<void(const JobProgress&)> on_progress;  // on the calling thread
  /// A server that is busy or leaving, or a connection that broke, is tried again with the
  /// same request id, so that a job that still runs is joined and not run twice; so often in
  /// all, and never beyond the timeout.
  int max_attempts = 4;
  /// Set: the job goes on when this call ends, and its result is kept so long for `attach`.
  std::optional<std::chrono::nanoseconds> result_ttl;
  std::stop_token stop;  // cancels the call
};

/// The answer to one job.
struct SmoothReport {
  SmoothSummary summary;
  std::string job_name;
  std::string request_id;
  double queue_seconds = 0;
  double receive_seconds = 0;
  double send_seconds = 0;
  bool topology_reused = false;  // the server had prepared it for an earlier job
  std::string server_version;
  std::shared_ptr<const v1::Summary> message;  // as it came

  /// meshsmooth.v1.Summary as proto3 JSON with original field names. Made at each call, which may
  /// take longer than a small job. What a call returned always has it.
  [[nodiscard]] std::string to_json() const;
};

struct ServerInfo {
  std::string version;
  std::string build_commit;
  std::vector<std::string> methods;
  std::vector<std::string> features;
  bool draining = false;
  std::string json;  // the whole GetServerInfoResponse
};

struct JobInfo {
  std::string name;
  std::string request_id;
  JobState state = JobState::unspecified;
  std::int64_t node_count = 0;
  std::int64_t element_count = 0;
  JobProgress progress;
  std::string error;  // "REASON: message" of a failed job
  std::string json;   // the whole Job
};

/// A topology that the server keeps for the caller.
struct TopologyInfo {
  std::string name;  // "topologies/sha256-…"
  std::int64_t node_count = 0;
  std::int64_t element_count = 0;
  std::int64_t boundary_node_count = 0;  // 0 while no job has found the boundary
  std::int64_t resident_bytes = 0;       // of the server's memory
};

/// How a connection is protected, and who calls. Files are in PEM but the token's.
struct Credentials {
  bool tls = false;           // even when nothing below is set
  std::string tls_ca = "";    // who may have signed the server's certificate; empty: the system's
  std::string tls_cert = "";  // ours, for servers that ask for one
  std::string tls_key = "";   // its key
  std::string tls_server_name = "";  // in the server's certificate; empty: the target's host
  std::string token_file = "";       // a bearer token, alone in its line; read anew for every call
};

/// A mesh whose nodes move from job to job while its elements stay, as in a time-step loop. The
/// server keeps the topology, and what it finds out about it, under a name made of its content; a
/// job sends coordinates only. A server that does not have it (any more) gets it once more, with
/// the job. The same positions give the same bits, whatever the server has. Not thread-safe; the
/// client must outlive it.
class Session {
 public:
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  /// The server's name of the topology, "topologies/sha256-…".
  [[nodiscard]] const std::string& topology_name() const;

  /// Smooths the positions in place: as many as the mesh has nodes, in either precision. Errors
  /// leave them as they were. `QualityDetail::brief` saves the server most of the evaluation.
  SmoothReport smooth(std::span<Vec3d> positions, const SmoothOptions& options,
                      const RequestOptions& request = {});
  SmoothReport smooth(std::span<Vec3f> positions, const SmoothOptions& options,
                      const RequestOptions& request = {});

 private:
  friend class Client;
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A connection to one server, or to several that do the same. Thread-safe: calls may run at the
/// same time. Every call throws `ServiceError`. Of positions that results of `smooth` have replaced
/// it keeps the memory for others, up to 64 MiB.
class Client {
 public:
  /// `target` is HOST:PORT or unix:PATH; or all servers that dns:///NAME:PORT resolves to, or
  /// ipv4:A:PORT,B:PORT lists, in turn: those that drain or are gone are left out, and a job that
  /// one of them had goes to another. Jobs by name are known to the server that has them only, so
  /// ask that one. Does not connect yet.
  /// Throws InvalidOption (CREDENTIALS_UNUSABLE) when a file of theirs cannot be
  /// read, or a token would travel in clear.
  explicit Client(const std::string& target, const Credentials& credentials = {});
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  /// Smooths `mesh` in place: positions change when the whole result has
  /// arrived, never before; nothing else changes.
  SmoothReport smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request = {});

  /// For many jobs on the topology of `mesh`, which is copied. Hashes it, sends nothing yet.
  [[nodiscard]] Session open(const Mesh& mesh);

  /// Waits for a job that was sent with `RequestOptions::result_ttl`, by whomever, and takes
  /// its positions into `mesh`, which is the one that was sent. Of `request` counts timeout,
  /// on_progress, max_attempts and stop; what has arrived before a connection broke is not
  /// sent again.
  SmoothReport attach(const std::string& job_name, Mesh& mesh, const RequestOptions& request = {});

  /// Throws `ServiceError` (TOPOLOGY_NOT_FOUND) when the server does not keep it for this caller.
  [[nodiscard]] TopologyInfo get_topology(const std::string& name);
  /// Makes the server drop a topology; jobs that use it go on. Throws as `get_topology`.
  void delete_topology(const std::string& name);

  [[nodiscard]] ServerInfo server_info();
  [[nodiscard]] std::vector<JobInfo> list_jobs();
  [[nodiscard]] JobInfo get_job(const std::string& name);
  /// Returns the job as it then is.
  JobInfo cancel_job(const std::string& name, bool keep_result = false);
  /// Lets the server forget a job that has ended, and its result.
  void delete_job(const std::string& name);
  /// Asks grpc.health.v1 for the whole server: true = SERVING.
  [[nodiscard]] bool healthy(std::chrono::milliseconds timeout = std::chrono::seconds(5));

 private:
  friend class Session;
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  friend struct ClientAccess;  // lets the CLI and tests hand in an in-process channel
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::client
