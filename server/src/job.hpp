#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "caller.hpp"
#include "job_queue.hpp"
#include "ledger.hpp"
#include "meshsmooth/job_state.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/summary.hpp"
#include "topology_cache.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

using Clock = std::chrono::steady_clock;

/// What the caller asked for, checked.
struct JobRequest {
  std::string identity = kAnonymous;  // who asks; the job is theirs alone
  std::string traceparent;            // of W3C's Trace Context; empty: none
  std::string request_id;             // empty: nobody can join
  /// All fields that were set, by name, in bytes: equal for the same job.
  std::map<std::string, std::string> fields;
  SmoothOptions options;
  Priority priority = Priority::normal;
  wire::MeshLayout layout;
  std::shared_ptr<CachedTopology> topology;   // set: only coordinates come
  bool topology_kept = false;                 // the one that comes enters the cache
  std::optional<Clock::time_point> deadline;  // of the call
  std::optional<Clock::duration> queue_timeout;
  /// Set: the job outlives its calls, and its result is kept so long.
  std::optional<Clock::duration> result_ttl;

  [[nodiscard]] bool kept() const { return result_ttl.has_value(); }
};

/// The positions that a job ended with, for every call that wants them, and the
/// promise of their bytes.
struct JobResult {
  Reservation reservation;
  wire::ByteArray coordinates;
};

/// When what happened; unset: not yet.
struct JobTimes {
  std::chrono::system_clock::time_point created;  // for people; the rest measures
  std::chrono::system_clock::time_point ended_wall;
  std::chrono::system_clock::time_point expires_wall;  // of a kept result
  Clock::time_point admitted;
  std::optional<Clock::time_point> queued, started, finished, ended;

  [[nodiscard]] double receive_seconds() const { return seconds(admitted, queued); }
  [[nodiscard]] double queue_seconds() const { return queued ? seconds(*queued, started) : 0; }
  [[nodiscard]] double run_seconds() const { return started ? seconds(*started, finished) : 0; }
  [[nodiscard]] double send_seconds() const { return finished ? seconds(*finished, ended) : 0; }

 private:
  // Up to the end of the job where the step was cut off by it.
  [[nodiscard]] double seconds(Clock::time_point from, std::optional<Clock::time_point> to) const {
    if (!to) to = ended;
    return to ? std::chrono::duration<double>(*to - from).count() : 0;
  }
};

/// All of a job but its mesh, copied at one moment.
struct JobSnapshot {
  JobState state = JobState::receiving;
  JobTimes times;
  Progress progress;  // the newest
  int progress_count = 0;
  std::shared_ptr<const SmoothSummary> summary;
  std::shared_ptr<const JobResult> result;
  std::string topology_name;  // of one that is cached
  bool topology_reused = false;
  std::exception_ptr error;  // why it failed or was cancelled
};

/// One request from admission to its end. Owns the mesh and the memory promised
/// for it. States:
///
///     receiving -> queued -> running -> sending -> succeeded
///     any of the first four -> failed | cancelled
///
/// or, when its result is kept, running -> succeeded -> expired.
///
/// It ends exactly once, and frees mesh, reservation and place then. Only the
/// actor whose turn it is may end it: the call that brings the mesh while
/// receiving, who takes it out of the queue while queued, the lane while
/// running, any call while sending. Everyone else asks by `request_stop`.
///
/// Calls watch it: the one that brought it, and those that joined. When the last
/// of them leaves a job that is not kept, it is asked to stop. Its positions
/// live on in `JobSnapshot::result` until then, kept ones until `expire`.
///
/// Thread-safe but for `mesh()`, which belongs to the actor whose turn it is.
class Job {
 public:
  /// Called after changes of state, progress and stop requests, without locks
  /// held, by any thread; must not block.
  using Observer = std::function<void()>;
  /// Called once, the same way, when all memory is given back.
  using EndObserver = std::function<void(const Job&)>;

  /// The mesh's arrays come from `memory`, which must outlive the job and its
  /// result; `result_bytes` is what the coordinates take of it.
  Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
      std::int64_t result_bytes, QueuePlace place, std::pmr::memory_resource* memory,
      EndObserver end_observer);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::int64_t sequence() const { return sequence_; }
  [[nodiscard]] const JobRequest& request() const { return request_; }
  [[nodiscard]] MemoryEstimate reserved_bytes() const { return reserved_bytes_; }
  /// That it runs on: where its memory was promised.
  [[nodiscard]] int device() const { return device_; }

  /// From now on the observer is called; give the number to `leave`. Nothing when
  /// there is nothing to wait for: the job was asked to stop, or is over and has
  /// no result.
  [[nodiscard]] std::optional<int> watch(Observer observer);
  [[nodiscard]] bool joinable() const;
  /// True when nobody is left to wait for the job, so that it is asked to stop, by
  /// `cause` unless it was already.
  bool leave(int watcher, const std::exception_ptr& cause);

  /// Needs a job that has not ended.
  [[nodiscard]] wire::MeshAssembler& mesh() { return *mesh_; }

  /// The cached topology that it runs on; nothing before and after, and for a job that
  /// brings its own for itself alone.
  [[nodiscard]] std::shared_ptr<CachedTopology> topology() const;
  /// Offers the topology that has come to the cache, if that was asked for. Needs a
  /// complete mesh; before `queue`. `bytes` is what its arrays take of the memory.
  void keep_topology(TopologyCache& cache, std::int64_t bytes);
  void note_topology_reused();

  // The walk. Each step needs the state before it.
  void queue();
  /// Gives the place in the queue back. False when the job was asked to stop before: it does
  /// not run.
  bool start();
  /// Ends the job instead when a stop was requested; and when it is kept.
  void finish(SmoothSummary summary);

  /// Ends the job: succeeded without an error, cancelled by a `Cancelled`,
  /// failed otherwise. A stop requested before takes the place of `error`.
  /// False when it had ended already.
  bool end(std::exception_ptr error = nullptr);

  /// Gives up the result of a job that succeeded.
  void expire();

  /// Asks the job to end by `cause`; false when it was asked before or is over.
  bool request_stop(std::exception_ptr cause);
  /// The same for a job that does not run yet; false, and nothing asked, when it does.
  bool hand_back(std::exception_ptr cause);
  [[nodiscard]] std::exception_ptr stop_cause() const;
  /// For how long it has been asked to stop; 0: it has not.
  [[nodiscard]] Clock::duration stopping_for(Clock::time_point now) const;
  [[nodiscard]] std::stop_token stop_token() const { return stop_.get_token(); }

  /// Asks the job to end with the positions reached so far.
  void finish_early() { finish_early_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] const std::atomic<bool>& finish_early_flag() const { return finish_early_; }

  /// The newest progress wins.
  void report(const Progress& progress);

  /// Its call's time is over, and nobody else waits for it.
  [[nodiscard]] bool past_deadline(Clock::time_point now) const;
  /// It is in the queue for longer than its caller wants.
  [[nodiscard]] bool waited_too_long(Clock::time_point now) const;

  [[nodiscard]] JobState state() const;
  [[nodiscard]] JobSnapshot snapshot() const;

 private:
  bool request_stop(std::exception_ptr cause, bool (*may_stop)(JobState));

  struct Watcher {
    int number;
    Observer observer;
  };
  void notify() const;
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

  // Given back in reverse order: the promise outlives the bytes.
  Reservation reservation_;
  std::shared_ptr<CachedTopology> topology_;
  QueuePlace place_;
  std::unique_ptr<wire::MeshAssembler> mesh_;

  mutable std::mutex mutex_;
  JobSnapshot now_;
  std::exception_ptr stop_cause_;
  Clock::time_point stop_requested_;
  std::vector<Watcher> watchers_;
  int next_watcher_ = 0;
};

}  // namespace meshsmooth::server
