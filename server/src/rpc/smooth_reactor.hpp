#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "rpc/gate.hpp"
#include "rpc/messages.hpp"
#include "upload_rate.hpp"
#include "wire/raw_message.hpp"

namespace meshsmooth::server {

/// Speaks the protocol of one Smooth call; never blocks, never computes.
///
/// Events (a read or write is done, the job changed, the client is gone, time
/// passed) only change the state and call `pump`. `next_step` looks at the
/// state and says what to do next; `pump` does it. One thread pumps at a time,
/// so there is at most one read and one write outstanding, and nothing is
/// started after `Finish`. No lock is held over a call into gRPC or engine:
/// both may come back by an event on the same thread. Messages are parsed and written here:
/// chunks go around protobuf (wire/raw_message.hpp).
class SmoothReactor final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                            public std::enable_shared_from_this<SmoothReactor> {
 public:
  /// The reactor of a new call; owns itself until gRPC is done with it.
  static SmoothReactor* start(Engine& engine, grpc::CallbackServerContext* context, Entry entry);

 private:
  enum class Step {
    none,
    read,
    write,
    submit_job,
    leave_job,    // by error_
    expire_job,   // waited too long in the queue
    succeed_job,  // all positions are sent
    arm_timer,
    abort,  // the client does not read
    finish,
  };

  /// What is written next.
  enum class Output { nothing, accepted, stop_sending, progress, chunks, summary, done };

  SmoothReactor(Engine& engine, grpc::CallbackServerContext* context, Entry entry);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;
  void on_timer(int generation);

  void pump();
  void perform(Step step);

  // Without the lock: one message that was read.
  void ingest();
  void ingest_chunk(const wire::ChunkView& chunk);
  void ingest_spec(const v1::JobSpec& spec);

  // With the lock.
  Step next_step();
  Step next_step_of_failure(Clock::time_point now);
  Step next_step_of_waiting();
  void notice_job(const JobSnapshot& job);
  void notice_idle_client(Clock::time_point now);
  bool prepare_write(const JobSnapshot& job, Clock::time_point now);
  bool prepare_progress(const JobSnapshot& job, Clock::time_point now);
  [[nodiscard]] v1::SmoothResponse accepted_message();
  void prepare_chunk();
  void wake_at(Clock::time_point time);
  void fail(std::exception_ptr error);
  [[nodiscard]] bool deadline_passed() const;

  Engine& engine_;
  grpc::CallbackServerContext* const context_;
  const Caller caller_;
  std::shared_ptr<SmoothReactor> self_;
  grpc::ByteBuffer request_;            // gRPC's while reading_
  grpc::ByteBuffer response_;           // gRPC's while writing_
  grpc::WriteOptions write_options_;    // of response_
  std::int64_t written_positions_ = 0;  // bytes of the result in response_

  std::mutex mutex_;
  bool pumping_ = false;
  bool reading_ = false;
  bool ingesting_ = false;  // a thread works on the mesh without the lock
  bool half_closed_ = false;
  bool writing_ = false;
  bool client_gone_ = false;
  bool client_stalled_ = false;
  bool aborted_ = false;
  bool finished_ = false;
  std::exception_ptr error_;  // the first; the call ends by it

  std::shared_ptr<Job> job_;
  Attendance attendance_;  // in that job, until the call leaves it
  std::shared_ptr<const JobResult> result_;
  CallOptions call_;
  MemoryEstimate estimate_;  // validate_only
  bool mesh_complete_ = false;
  bool submitted_ = false;
  bool left_ = false;

  Output output_ = Output::nothing;
  std::int64_t sent_bytes_ = 0;
  bool stop_sending_written_ = false;
  Clock::time_point drop_until_;
  Clock::time_point last_read_;
  UploadRate upload_rate_;
  Clock::time_point write_began_;

  JobState seen_state_ = JobState::receiving;
  int seen_progress_count_ = 0;
  int seen_position_ = 0;
  Clock::time_point next_progress_;

  std::optional<Clock::time_point> wake_;      // when next_step wants to look again
  std::optional<Clock::time_point> alarm_at_;  // when it will
  int alarm_generation_ = 0;
  std::unique_ptr<grpc::Alarm> alarm_;  // touched by the pumping thread only
};

}  // namespace meshsmooth::server
