#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "caller.hpp"
#include "job_queue.hpp"
#include "memory_budget.hpp"
#include "meshsmooth/job_state.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/summary.hpp"
#include "topology_cache.hpp"
#include "upload_share.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

using Clock = std::chrono::steady_clock;

/// Coordinates that are not uploaded: the smoother reads them, and writes those of the result, by
/// itself in memory of `owner`, where others may write at any time.
struct CoordinatesInPlace {
  std::shared_ptr<void> owner;
  std::span<const std::byte> given;  // empty: there are none
  std::span<std::byte> result;
};

/// A validated request.
struct JobRequest {
  std::string caller = kAnonymous;  // only this caller can access the job
  std::string traceparent;          // of W3C's Trace Context; empty: none
  std::string connection;           // that brings the mesh; empty: its uploads are not limited
  std::string share;                // see Caller
  std::string request_id;           // empty: no other call can join
  /// All set fields, serialized, or their digests, by name: equal for the same job.
  std::map<std::string, std::string> fields;
  SmoothOptions options;
  Priority priority = Priority::normal;
  wire::MeshLayout layout;
  std::shared_ptr<CachedTopology> topology;  // set: only coordinates are uploaded
  bool topology_kept = false;                // add the uploaded topology to the cache
  std::optional<CoordinatesInPlace> coordinates_in_place;
  bool progress_wanted = true;                // by the call
  std::optional<Clock::time_point> deadline;  // of the call
  std::optional<Clock::duration> queue_timeout;
  /// Set: the job outlives its calls, and its result is kept for this time.
  std::optional<Clock::duration> result_ttl;

  [[nodiscard]] bool kept() const { return result_ttl.has_value(); }
  /// For the queue and what is kept: without a share of its own, the caller's.
  [[nodiscard]] const std::string& share_or_caller() const {
    return share.empty() ? caller : share;
  }
  [[nodiscard]] std::int64_t element_quality_bytes() const {
    const std::size_t bytes = options.element_quality_metrics.size() * sizeof(float);
    return layout.element_count() * static_cast<std::int64_t>(bytes);
  }
  /// Of all arrays of the result.
  [[nodiscard]] std::int64_t result_bytes() const {
    return layout.coordinates_bytes + element_quality_bytes();
  }
};

/// The arrays that a job ended with, in the order in which they are sent, shared by all calls that
/// send them, and the reservation of their bytes.
struct JobResult {
  Reservation reservation;
  wire::ByteArray coordinates;
  std::vector<float> element_quality;  // ElementQualityArrays::values

  /// The rest of an array.
  struct Part {
    v1::ArrayId array_id;
    std::int64_t offset_bytes;  // in the array
    std::span<const std::byte> bytes;
  };
  /// What follows an offset in all arrays, up to the end of the array there.
  [[nodiscard]] Part part_at(std::int64_t offset_bytes) const;
};

/// When each step happened; unset: not yet.
struct JobTimes {
  std::chrono::system_clock::time_point created;  // for display; the steady clock measures
  std::chrono::system_clock::time_point ended_wall;
  std::chrono::system_clock::time_point expires_wall;  // of a kept result
  Clock::time_point admitted;
  std::optional<Clock::time_point> queued, started, finished, ended;

  [[nodiscard]] double receive_seconds() const { return seconds(admitted, queued); }
  [[nodiscard]] double queue_seconds() const { return queued ? seconds(*queued, started) : 0; }
  [[nodiscard]] double run_seconds() const { return started ? seconds(*started, finished) : 0; }
  [[nodiscard]] double send_seconds() const { return finished ? seconds(*finished, ended) : 0; }

 private:
  // Up to the end of the job if it ended during the step.
  [[nodiscard]] double seconds(Clock::time_point from, std::optional<Clock::time_point> to) const {
    if (!to) to = ended;
    return to ? std::chrono::duration<double>(*to - from).count() : 0;
  }
};

/// A consistent copy of everything about a job except its mesh.
struct JobSnapshot {
  JobState state = JobState::receiving;
  JobTimes times;
  Progress progress;  // the newest
  int progress_count = 0;
  std::shared_ptr<const SmoothSummary> summary;
  std::shared_ptr<const JobResult> result;
  std::string topology_name;  // of one that is cached
  bool topology_reused = false;
  std::exception_ptr stop_cause;  // why it was asked to stop
  std::exception_ptr error;       // why it failed or was cancelled
};

/// One request from admission to its end. Owns the mesh and its memory reservation. States:
///
///     receiving -> queued -> running -> sending -> succeeded
///     any of the first four -> failed | cancelled
///
/// or, when its result is kept, running -> succeeded -> expired.
///
/// It ends exactly once, and frees mesh, reservation and place then. Only the engine ends it, on
/// behalf of the actor whose turn it is: the call that uploads the mesh while receiving, whoever
/// removes it from the queue while queued, the lane while running, any call while sending.
/// Everyone else asks it to stop by `request_stop`.
///
/// Calls subscribe to it: the one that created it, and those that joined. When the last of them
/// leaves a job that is not kept, it is asked to stop. Its positions stay in `JobSnapshot::result`
/// until then, kept ones until `expire`.
///
/// Thread-safe except `mesh()` and `given_positions()`, which belong to the actor whose turn it is.
class Job {
 public:
  /// Called after changes of state, progress and stop requests, without locks
  /// held, by any thread; must not block.
  using Observer = std::function<void()>;
  /// Called once, the same way, when all memory has been released.
  using EndObserver = std::function<void(const Job&)>;

  /// The arrays of the mesh are allocated from `memory`, which must outlive the job and its
  /// result, which takes `result_bytes` of the reservation.
  Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
      std::int64_t result_bytes, UploadShare upload, std::pmr::memory_resource* memory,
      EndObserver end_observer);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::int64_t sequence() const { return sequence_; }
  [[nodiscard]] const JobRequest& request() const { return request_; }
  [[nodiscard]] MemoryEstimate reserved_bytes() const { return reserved_bytes_; }
  /// The device that it runs on: where its memory was reserved.
  [[nodiscard]] int device() const { return device_; }

  /// From now on the observer is called; pass the returned id to `leave`. Nothing when there is
  /// nothing to wait for: the job was asked to stop, or has ended without a kept result.
  /// `of_progress`: of it too.
  [[nodiscard]] std::optional<int> observe(Observer observer, bool of_progress = true);
  [[nodiscard]] bool joinable() const;
  /// Its memory counts against the caller's share until it ends. Call it before anyone else has it.
  void count_against(UploadShare caller_share) { caller_share_ = std::move(caller_share); }
  /// Calls the observers.
  void notify(bool of_progress = false) const;
  /// Returns true when no observer is left, so that the job is asked to stop, with
  /// `cause` unless it was already.
  bool leave(int observer_id, const std::exception_ptr& cause);

  /// Needs a job that has not ended.
  [[nodiscard]] wire::MeshAssembler& mesh() { return *mesh_; }
  /// Where the smoother reads the coordinates: in the mesh, unless they are there in place.
  [[nodiscard]] PositionsView given_positions();

  /// The cached topology that it runs on; nothing before and after, and for a job with a
  /// topology of its own.
  [[nodiscard]] std::shared_ptr<CachedTopology> topology() const;
  /// Adds the uploaded topology, whose arrays take `bytes`, to the cache if the request asks for
  /// it. Needs a complete mesh; call it before `queue`.
  void keep_topology(TopologyCache& cache, std::int64_t bytes);
  void note_topology_reused();

  // State transitions; each requires the preceding state.
  /// Releases the upload's part of the connection's share.
  void queue(QueuePlace place);
  /// Releases the place in the queue. False when the job was asked to stop before: it must not
  /// run.
  bool start();
  /// Smoothed: from now on the result can be sent. False, and nothing is done, when the job was
  /// asked to stop: the caller may be gone, and nobody would send the result.
  bool finish(SmoothSummary summary);

  /// Ends the job: succeeded without an error, cancelled by a `Cancelled`,
  /// failed otherwise. The cause of an earlier stop request replaces `error`.
  /// False when it had already ended.
  bool end(std::exception_ptr error = nullptr);

  /// Drops the result of a job that succeeded.
  void expire();

  /// Asks the job to end with `cause`; false when it was asked before or has ended.
  bool request_stop(std::exception_ptr cause);
  /// The same for a job that does not run yet; false, without effect, when it does.
  bool reject(std::exception_ptr cause);
  [[nodiscard]] std::exception_ptr stop_cause() const;
  /// Time since it was asked to stop; 0: it was not.
  [[nodiscard]] Clock::duration stopping_for(Clock::time_point now) const;
  [[nodiscard]] std::stop_token stop_token() const { return stop_.get_token(); }

  /// Asks the job to end with the positions reached so far.
  void finish_early() { finish_early_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] const std::atomic<bool>& finish_early_flag() const { return finish_early_; }

  /// Counts host memory that the running job needs beyond its estimate. Throws OutOfMemory.
  void reserve_more(std::int64_t host_bytes);

  /// Replaces the previous progress.
  void report(const Progress& progress);

  /// Whether the deadline of its call has passed and no other call waits for it.
  [[nodiscard]] bool past_deadline(Clock::time_point now) const;
  /// Whether it has been queued for longer than its queue timeout.
  [[nodiscard]] bool waited_too_long(Clock::time_point now) const;
  /// Whether it has been running for longer than `limit`.
  [[nodiscard]] bool ran_too_long(Clock::time_point now, Clock::duration limit) const;

  [[nodiscard]] JobState state() const;
  /// Whether its result is still there.
  [[nodiscard]] bool has_result() const;
  [[nodiscard]] JobSnapshot snapshot() const;

 private:
  bool request_stop(std::exception_ptr cause, bool (*may_stop)(JobState));

  struct Registration {
    int id;
    Observer observer;
    bool of_progress;
  };
  [[nodiscard]] bool joinable_now() const;  // with the lock

  const std::string name_;
  const std::int64_t sequence_;
  const JobRequest request_;
  const MemoryEstimate reserved_bytes_;
  const int device_;
  const std::int64_t result_bytes_;
  const EndObserver end_observer_;
  std::stop_source stop_;
  std::atomic<bool> finish_early_ = false;

  // Released in reverse order: the reservation outlives the bytes.
  Reservation reservation_;
  std::shared_ptr<CachedTopology> topology_;
  UploadShare upload_, caller_share_;
  QueuePlace place_;
  std::unique_ptr<wire::MeshAssembler> mesh_;
  const std::optional<std::span<const std::byte>> given_in_place_;  // of the mesh's owner

  mutable std::mutex mutex_;
  JobSnapshot now_;
  std::exception_ptr stop_cause_;
  Clock::time_point stop_requested_;
  std::vector<Registration> observers_;
  int next_observer_id_ = 0;
};

}  // namespace meshsmooth::server
