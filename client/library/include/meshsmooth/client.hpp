#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <variant>
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

/// A failed call. `reason()` is the server's ErrorInfo.reason, or "" when the error did not come
/// from a meshsmooth server; `hint()` then says what such an error usually means and what to do.
/// Hints name fields of this library, e.g. `Credentials::tls_ca`.
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
  /// The delay after which the same request may succeed; unset: it will not.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> retry_delay() const noexcept {
    return retry_delay_;
  }

 private:
  StatusCode code_;
  std::string hint_;
  std::optional<std::chrono::nanoseconds> retry_delay_;
};

/// The progress of a job, as the server last reported it.
struct JobProgress {
  JobState state = JobState::unspecified;
  int queue_position = 0;  ///< 1 = next; 0 = not queued.
  std::string stage;       ///< "find_neighbours", "iterate" …; empty unless running.
  int iteration = 0;
  double max_displacement = 0;  ///< Of the last sweep, in the mesh's unit.
  double rms_displacement = 0;
};

/// The options of one call.
struct RequestOptions {
  std::string request_id;        ///< A UUID; empty: a new one.
  std::string backend = "auto";  ///< A name of backend_name.hpp without a device.
  /// The caller's span, in the format of W3C Trace Context, the parent of those that the server
  /// sends to its collector; empty: none. An invalid one is an InvalidOption.
  std::string traceparent = "";
  /// Timeout of the whole call. Unset: 10 minutes, plus 1 s per MB of the mesh, plus 10 us per
  /// element and allowed iteration; at most a week.
  std::optional<std::chrono::nanoseconds> timeout;
  std::chrono::milliseconds progress_interval{100};
  std::function<void(const JobProgress&)> on_progress;  ///< Called on the calling thread.
  /// Attempts in all, within the timeout. A call to a busy or draining server, or over a connection
  /// that broke, is repeated with the same request id, so that a job that still runs is joined and
  /// not run twice.
  int max_attempts = 4;
  /// Set: the job outlives this call, and its result is kept this long for `attach`.
  std::optional<std::chrono::nanoseconds> result_ttl;
  /// Whether the mesh may travel through memory shared with the server, where the target is a Unix
  /// socket and the server can. The first job uses chunks while the memory is being created, so
  /// this does not help a single job.
  bool shared_memory = true;
  std::stop_token stop;  ///< Cancels the call.
};

/// The report on one job.
struct SmoothReport {
  SmoothSummary summary;
  std::string job_name;
  std::string request_id;
  double queue_seconds = 0;
  double receive_seconds = 0;
  double send_seconds = 0;
  bool shared_memory = false;    ///< The mesh travelled through memory shared with the server.
  bool topology_reused = false;  ///< The server had prepared the topology for an earlier job.
  std::string server_version;
  std::shared_ptr<const v1::Summary> message;  ///< As received.

  /// Returns meshsmooth.v1.Summary as proto3 JSON with original field names; "{}" without
  /// `message`. Formatted at each call, which may take longer than a small job.
  [[nodiscard]] std::string to_json() const;
};

/// What came of one mesh of many: the report, or the exception of the call.
using SmoothOutcome = std::variant<SmoothReport, std::exception_ptr>;

/// What a server is and has.
struct ServerInfo {
  std::string version;
  std::string build_commit;
  std::vector<std::string> methods;
  std::vector<std::string> features;
  bool draining = false;
  std::string json;  ///< The whole GetServerInfoResponse.
};

/// A job as the server knows it.
struct JobInfo {
  std::string name;
  std::string request_id;
  JobState state = JobState::unspecified;
  std::int64_t node_count = 0;
  std::int64_t element_count = 0;
  JobProgress progress;
  std::string error;  ///< "REASON: message" of a failed job.
  std::string json;   ///< The whole Job.
};

/// A topology that the server keeps for the caller.
struct TopologyInfo {
  std::string name;  ///< "topologies/sha256-…".
  std::int64_t node_count = 0;
  std::int64_t element_count = 0;
  std::int64_t boundary_node_count = 0;  ///< 0 until a job has found the boundary.
  std::int64_t resident_bytes = 0;       ///< Of the server's memory.
};

/// Credentials of a connection. All files but the token's are PEM.
struct Credentials {
  bool tls = false;           ///< TLS, even when nothing below is set.
  std::string tls_ca = "";    ///< Authorities of the server's certificate; empty: the system's.
  std::string tls_cert = "";  ///< Client certificate, for servers that require one.
  std::string tls_key = "";   ///< Key of `tls_cert`.
  std::string tls_server_name = "";  ///< In the server's certificate; empty: the target's host.
  std::string token_file = "";       ///< A bearer token on one line; read anew for each call.
};

/// A product with the Jacobian matrix of `Move`'s linear prediction, or with its transpose.
struct MotionDerivative {
  decltype(Mesh::positions) vectors;  ///< In the mesh's unit, or that of the scalar by it.
  SmoothReport report;                ///< `summary.motion` has the residual of the linear solver.
};

/// A mesh whose nodes move from job to job while its elements stay, as in a time-step loop.
///
/// The server keeps the topology and what it prepared of it under a name made of its content; a job
/// sends coordinates only. A server that does not have the topology receives it once more, with the
/// job. The same positions give the same bits, whatever the server has. Not thread-safe; the client
/// must outlive it.
class Session {
 public:
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  /// Returns the server's name of the topology, "topologies/sha256-…".
  [[nodiscard]] const std::string& topology_name() const;

  /// Smooths the positions in place; on errors they are unchanged.
  /// @param positions one for each node of the mesh, in either precision.
  /// `QualityDetail::brief` saves the server most of the evaluation.
  /// @param input what else the job is given: of `Optimize` a reference, node pairs.
  SmoothReport smooth(std::span<Vec3d> positions, const SmoothOptions& options,
                      const RequestOptions& request = {}, const JobInput& input = {});
  SmoothReport smooth(std::span<Vec3f> positions, const SmoothOptions& options,
                      const RequestOptions& request = {}, const JobInput& input = {});

  /// Smooths what lies in `positions_span()`; on errors it is unchanged.
  SmoothReport smooth(const SmoothOptions& options, const RequestOptions& request = {},
                      const JobInput& input = {});

  /// Moves nodes of the mesh, as it was opened, to given positions and lets the rest follow: a step
  /// of a motion. Does not depend on earlier steps. The server keeps the mesh's own positions, the
  /// reference, with the topology, so that a step sends the prescribed nodes alone.
  /// @param nodes which nodes, each once.
  /// @param positions [nodes.size()], where they shall lie.
  /// @param options whose method is `Move`.
  /// @param input node pairs; its prescribed nodes are those above.
  /// @returns the report, `summary.motion` among it: look at `reached`. The mesh lies in
  ///   `positions()` until the next call.
  SmoothReport move(std::span<const NodeId> nodes, PositionsView positions,
                    const SmoothOptions& options = {.method = Move{}},
                    const RequestOptions& request = {}, JobInput input = {});
  /// The derivative of `move` by the displacements of its prescribed nodes, forward: the product of
  /// the Jacobian matrix J of its linear prediction with a tangent. It is that of the mesh as it
  /// was opened, whatever the motion, and exact to a residual of 1e-13 in double. `positions()`
  /// stay.
  /// @param nodes which nodes, each once.
  /// @param tangents [nodes.size()], their displacements.
  /// @param options whose method is `Move`; its `derivative` is set here.
  /// @param input node pairs.
  /// @returns the displacements of all nodes, in the mesh's precision. O(edges * iterations).
  MotionDerivative move_tangent(std::span<const NodeId> nodes, PositionsView tangents,
                                SmoothOptions options = {.method = Move{}},
                                const RequestOptions& request = {}, JobInput input = {});
  /// The same backward: the product of the transpose of J with a cotangent, for gradients.
  /// @param cotangents [node_count], the derivatives of a scalar by the positions of all nodes.
  /// @returns its derivatives by the positions of the prescribed nodes, in their order.
  MotionDerivative move_transpose(std::span<const NodeId> nodes, PositionsView cotangents,
                                  SmoothOptions options = {.method = Move{}},
                                  const RequestOptions& request = {}, JobInput input = {});
  /// Returns the positions that the last call of `smooth` or `move` ended with, in the precision of
  /// that call, or the mesh's own; on errors, what lay there before. Valid until the next call.
  [[nodiscard]] PositionsView positions() const;
  /// Returns the same to be changed, for the next step. Over a Unix socket they lie in the memory
  /// that is shared with the server, from the second or third call on: nothing is copied then. The
  /// server's memory budget counts that memory until the session ends.
  [[nodiscard]] PositionsSpan positions_span();

 private:
  friend class Client;
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A connection to one server, or to several equal ones. Thread-safe: calls may run concurrently.
/// Every call throws `ServiceError`. The memory of positions that results of `smooth` replaced is
/// cached for later results, up to 64 MiB. Over a Unix socket meshes travel through memory that is
/// shared with the server; it is kept until the client is destroyed, or the server wants it back.
class Client {
 public:
  /// Does not connect yet.
  /// @param target HOST:PORT or unix:PATH; or several servers, used in turn: dns:///NAME:PORT (all
  ///   that it resolves to) or ipv4:A:PORT,B:PORT. Servers that drain or are gone are skipped, and
  ///   their jobs go to others. Only the server that has a job knows its name.
  /// @param credentials of the connection; the default is neither TLS nor a token.
  /// @throws InvalidOption CREDENTIALS_UNUSABLE: a file cannot be read, or a token would travel in
  ///   clear.
  explicit Client(const std::string& target, const Credentials& credentials = {});
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  /// Smooths `mesh` in place: its positions change when the whole result has arrived, never before;
  /// nothing else changes. The summary has the `element_quality_metrics` of the options.
  /// @param input a reference, prescribed nodes, node pairs, a surface; the job must use each.
  /// @throws NotSupported OPTION_NOT_SUPPORTED, before anything is sent: it has no use for one.
  /// @throws ServiceError OPTION_NOT_SUPPORTED: an older server, without those metrics.
  SmoothReport smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request = {},
                      const JobInput& input = {});

  /// Smooths many meshes in place, each as `smooth` does: it ends by its own rule, with the bits
  /// that it has alone, and a mesh that fails does so alone, unchanged.
  /// @param meshes the meshes, each in the order of `on_end`.
  /// @param options of every job.
  /// @param request of every job, without a request id; `on_progress` is called by several threads.
  /// @param on_end called once for each mesh by the calling thread, with its index and what came of
  ///   it, in the order of the meshes and as soon as that permits. What it throws cancels the jobs
  ///   that are left and is rethrown.
  /// @param max_in_flight jobs at a time, 1 or more, each with a thread.
  /// @throws InvalidOption OPTION_MISPLACED: a request id; OPTION_OUT_OF_RANGE: `max_in_flight`.
  void smooth_many(std::span<Mesh> meshes, const SmoothOptions& options,
                   const RequestOptions& request,
                   const std::function<void(std::size_t, SmoothOutcome)>& on_end,
                   int max_in_flight = 16);

  /// Opens a session for many jobs on the topology of `mesh`, which is copied. Hashes it,
  /// O(elements); sends nothing yet.
  [[nodiscard]] Session open(const Mesh& mesh);

  /// Waits for a job that was sent with `RequestOptions::result_ttl` and takes its positions into
  /// `mesh`, which must be the one that was sent. Data that arrived before a connection broke is
  /// not sent again.
  /// @param job_name "jobs/…".
  /// @param mesh the mesh of the job.
  /// @param request timeout, on_progress, max_attempts and stop count; the rest is ignored.
  SmoothReport attach(const std::string& job_name, Mesh& mesh, const RequestOptions& request = {});

  /// @throws ServiceError TOPOLOGY_NOT_FOUND: the server does not keep it for this caller.
  [[nodiscard]] TopologyInfo get_topology(const std::string& name);
  /// Makes the server drop a topology; jobs that use it continue.
  /// @throws ServiceError TOPOLOGY_NOT_FOUND.
  void delete_topology(const std::string& name);

  /// Describes the server.
  [[nodiscard]] ServerInfo server_info();
  /// Lists the caller's jobs, running and ended.
  [[nodiscard]] std::vector<JobInfo> list_jobs();
  /// @throws ServiceError JOB_NOT_FOUND.
  [[nodiscard]] JobInfo get_job(const std::string& name);
  /// Cancels a job and returns its new state. With `keep_result` its waiting callers receive the
  /// positions reached so far.
  JobInfo cancel_job(const std::string& name, bool keep_result = false);
  /// Deletes a job that has ended, and its result.
  void delete_job(const std::string& name);
  /// Returns whether grpc.health.v1 reports SERVING for the whole server.
  [[nodiscard]] bool healthy(std::chrono::milliseconds timeout = std::chrono::seconds(5));

 private:
  friend class Session;
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  friend struct ClientAccess;  // lets the CLI and tests hand in an in-process channel
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::client
