#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "job_queue.hpp"
#include "ledger.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/summary.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

enum class JobState { receiving, queued, running, sending, succeeded, failed, cancelled };

[[nodiscard]] bool has_ended(JobState state);
[[nodiscard]] const char* state_name(JobState state);

using Clock = std::chrono::steady_clock;

/// Who asks when nothing says who.
inline constexpr const char* kAnonymous = "anonymous";

/// What the caller asked for, checked.
struct JobRequest {
  std::string identity = kAnonymous;  // who asks; the job is theirs alone
  std::string request_id;
  SmoothOptions options;
  Priority priority = Priority::normal;
  wire::MeshLayout layout;
  std::optional<Clock::time_point> deadline;
};

/// When what happened; unset: not yet.
struct JobTimes {
  std::chrono::system_clock::time_point created;  // for people; the rest measures
  std::chrono::system_clock::time_point ended_wall;
  Clock::time_point admitted;
  std::optional<Clock::time_point> queued, started, finished, ended;
  std::optional<Clock::time_point> stop_requested;

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
  std::exception_ptr error;  // why it failed or was cancelled
};

/// One request from admission to its end. Owns the mesh and the memory promised
/// for it. States:
///
///     receiving -> queued -> running -> sending -> succeeded
///     any of the first four -> failed | cancelled
///
/// It ends exactly once, and frees mesh, reservation and place then. Only the
/// actor whose turn it is may end it: the call while receiving and sending, who
/// takes it out of the queue while queued, the lane while running. Everyone
/// else asks by `request_stop`. Thread-safe but for `mesh()`, which belongs to
/// the actor whose turn it is.
class Job {
 public:
  /// Called after changes of state, progress and stop requests, without locks
  /// held, by any thread; must not block.
  using Observer = std::function<void()>;
  /// Called once, the same way, when all memory is given back.
  using EndObserver = std::function<void(const Job&)>;

  /// The mesh's arrays come from `memory`, which must outlive the job's end.
  Job(std::string name, std::int64_t sequence, JobRequest request, Reservation reservation,
      QueuePlace place, std::pmr::memory_resource* memory, EndObserver end_observer,
      Observer observer);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::int64_t sequence() const { return sequence_; }
  [[nodiscard]] const JobRequest& request() const { return request_; }
  [[nodiscard]] MemoryEstimate reserved_bytes() const { return reserved_bytes_; }

  /// Needs a job that has not ended.
  [[nodiscard]] wire::MeshAssembler& mesh() { return *mesh_; }

  // The walk. Each step needs the state before it.
  void queue();
  void start();                        // gives the place in the queue back
  void finish(SmoothSummary summary);  // ends the job instead when a stop was requested

  /// Ends the job: succeeded without an error, cancelled by a `Cancelled`,
  /// failed otherwise. A stop requested before takes the place of `error`.
  /// False when it had ended already.
  bool end(std::exception_ptr error = nullptr);

  /// Asks the job to end by `cause`; false when it was asked before or is over.
  bool request_stop(std::exception_ptr cause);
  [[nodiscard]] std::exception_ptr stop_cause() const;
  [[nodiscard]] std::stop_token stop_token() const { return stop_.get_token(); }

  /// Asks the job to end with the positions reached so far.
  void finish_early() { finish_early_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] const std::atomic<bool>& finish_early_flag() const { return finish_early_; }

  /// The newest progress wins.
  void report(const Progress& progress);

  [[nodiscard]] JobState state() const;
  [[nodiscard]] JobSnapshot snapshot() const;

 private:
  const std::string name_;
  const std::int64_t sequence_;
  const JobRequest request_;
  const MemoryEstimate reserved_bytes_;
  const EndObserver end_observer_;
  const Observer observer_;
  std::stop_source stop_;
  std::atomic<bool> finish_early_ = false;

  // Given back in reverse order: the promise outlives the bytes.
  Reservation reservation_;
  QueuePlace place_;
  std::unique_ptr<wire::MeshAssembler> mesh_;

  mutable std::mutex mutex_;
  JobSnapshot now_;
  std::exception_ptr stop_cause_;
};

}  // namespace meshsmooth::server
