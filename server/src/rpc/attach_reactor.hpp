#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::server {

/// Speaks the protocol of one AttachJob call: progress of a job that is there,
/// then its result. Works as `SmoothReactor` does, without reading.
class AttachReactor final : public grpc::ServerWriteReactor<v1::AttachJobResponse>,
                            public std::enable_shared_from_this<AttachReactor> {
 public:
  /// The reactor of a new call; owns itself until gRPC is done with it. `job` may
  /// be null: not found.
  static AttachReactor* start(Engine& engine, grpc::CallbackServerContext* context,
                              std::shared_ptr<Job> job, const v1::AttachJobRequest& request);

 private:
  enum class Output { progress, chunks, done };

  AttachReactor(Engine& engine, grpc::CallbackServerContext* context, std::shared_ptr<Job> job,
                std::int64_t offset)
      : engine_(engine), context_(context), job_(std::move(job)), sent_bytes_(offset) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void attend();
  void pump();
  // With the lock.
  void leave_if_failed(std::unique_lock<std::mutex>& lock);
  void notice_job(const JobSnapshot& job);
  [[nodiscard]] bool all_sent() const;
  bool prepare_write(const JobSnapshot& job, Clock::time_point now);
  void fail(std::exception_ptr error);
  void wake_at(Clock::time_point time);

  Engine& engine_;
  grpc::CallbackServerContext* const context_;
  const std::shared_ptr<Job> job_;
  std::shared_ptr<AttachReactor> self_;
  v1::AttachJobResponse response_;  // gRPC's while writing_

  std::mutex mutex_;
  bool pumping_ = false;
  bool writing_ = false;
  bool finished_ = false;
  bool client_gone_ = false;
  bool left_ = false;
  std::exception_ptr error_;
  Attendance attendance_;
  std::shared_ptr<const JobResult> result_;
  Output output_ = Output::progress;
  std::int64_t sent_bytes_;
  int seen_progress_count_ = -1;
  JobState seen_state_ = JobState::receiving;
  Clock::time_point next_progress_;
  Clock::time_point write_began_;
  std::unique_ptr<grpc::Alarm> alarm_;
  std::optional<Clock::time_point> alarm_at_;
};

}  // namespace meshsmooth::server
