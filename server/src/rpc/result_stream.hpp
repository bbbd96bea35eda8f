#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>

#include "job.hpp"

namespace meshsmooth::server {

/// What a call is sent of its job: progress, then the result's header, its chunks and the
/// summary; in place the header first of all, so that nothing but the summary is left to send at
/// the end. A pure state machine: `notice` and then `next` get a snapshot of the job and the time,
/// and `next` returns what to send, or when to ask again. Knows neither gRPC nor the engine. Not
/// thread-safe.
class ResultStream {
 public:
  struct Options {
    std::optional<std::chrono::nanoseconds> progress_interval;  // unset: no progress
    /// Report the state at once, not only after its first change.
    bool report_at_once = false;
    int chunk_bytes = 0;
    std::int64_t result_bytes = 0;
    std::int64_t offset = 0;  // of the first byte to send
    bool in_place = false;    // the arrays are in place when the summary is sent: no chunks
    /// The call has joined the job of another call, which uploads the mesh.
    bool upload_by_another_call = false;
    /// The call may end a job that is asked to stop while it receives its mesh.
    bool ends_uploads = true;
  };

  enum class Action {
    wait,           // until `wake`, or until the job changes
    send_progress,  // of the snapshot
    send_header,
    send_chunk,    // `data` at `offset`
    complete_job,  // the result is sent: the job has succeeded
    send_summary,  // of the snapshot: the last message
  };

  struct Step {
    Action action = Action::wait;
    std::optional<Clock::time_point> wake = {};
    v1::ArrayId array_id = v1::ARRAY_ID_UNSPECIFIED;  // of a chunk, as the next two
    std::int64_t offset = 0;                          // in the array
    std::span<const std::byte> data = {};             // valid until `release`
    bool in_place = false;                            // of a header
  };

  explicit ResultStream(const Options& options)
      : options_(options),
        sent_bytes_(options.offset),
        seen_progress_count_(options.report_at_once ? -1 : 0) {}

  /// Takes the result as soon as there is one. Returns why the call must fail; nothing as long as
  /// the job can still deliver its result.
  [[nodiscard]] std::exception_ptr notice(const JobSnapshot& job);

  /// Whether `next` needs the job's position in the queue, which is costly to find.
  [[nodiscard]] bool needs_queue_position(const JobSnapshot& job) const;

  /// What to do now. The next call assumes that it was done.
  [[nodiscard]] Step next(const JobSnapshot& job, int queue_position, Clock::time_point now);

  /// Drops the result: the call has failed and sends no more of it.
  void release() { result_.reset(); }

 private:
  enum class Part { progress, chunks, done };

  [[nodiscard]] Step header() {
    header_sent_ = true;
    return {.action = Action::send_header, .in_place = options_.in_place};
  }

  [[nodiscard]] Step next_progress(const JobSnapshot& job, int queue_position,
                                   Clock::time_point now);
  [[nodiscard]] Step next_chunk();

  const Options options_;
  std::shared_ptr<const JobResult> result_;
  Part part_ = Part::progress;
  bool header_sent_ = false;
  std::int64_t sent_bytes_;

  // Of the job as the client knows it.
  JobState seen_state_ = JobState::receiving;
  int seen_progress_count_;
  int seen_position_ = 0;
  Clock::time_point next_progress_;
};

}  // namespace meshsmooth::server
