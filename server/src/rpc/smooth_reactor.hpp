#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "rpc/authenticator.hpp"
#include "rpc/job_call.hpp"
#include "rpc/messages.hpp"
#include "upload_rate.hpp"
#include "wire/raw_message.hpp"

namespace meshsmooth::server {

/// Speaks the protocol of one Smooth call; never blocks, never computes. Messages are parsed and
/// written here: chunks go around protobuf (wire/raw_message.hpp).
class SmoothReactor final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                            public JobCall<SmoothReactor, v1::SmoothResponse> {
 public:
  /// The reactor of a new call; owns itself until gRPC is done with it.
  static SmoothReactor* start(Engine& engine, grpc::CallbackServerContext* context,
                              AuthResult auth);

 private:
  friend CallLoop;
  friend JobCall;

  /// What the client still has to send. `over`: the job is queued, or needs no mesh of this call.
  enum class Upload { awaiting_spec, receiving, complete, over };
  /// What is written next; `result` leaves it to the stream, `status` is the end.
  enum class Answer { none, accepted, input_taken, stop_sending, result, status };
  /// `ingesting`: a thread works on the mesh without the lock.
  enum class Input { idle, reading, ingesting, half_closed };
  /// Of a result that does not travel in chunks.
  enum class Download { none, begun, done };

  SmoothReactor(Engine& engine, grpc::CallbackServerContext* context, AuthResult auth);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override { write_done(ok); }
  void OnCancel() override;
  void OnDone() override;

  // Without the lock: one message that was read.
  void ingest();
  void ingest_chunk(const wire::ChunkView& chunk);
  void ingest_spec(const v1::JobSpec& spec);
  // Without the lock: of arrays that do not travel in chunks.
  void upload_done(std::int64_t bytes, const std::exception_ptr& error);
  void download_done();

  // With the lock.
  Action next_action(Clock::time_point now);
  Action next_of_failure(Clock::time_point now);
  Action next_answer(const JobSnapshot& job, Clock::time_point now);
  Action next_of_result(const JobSnapshot& job, Clock::time_point now);
  Action next_read();
  /// With the status, or before it.
  Action write_summary(grpc::ByteBuffer message, Clock::time_point now);
  /// Whether the client has half-closed, or had time to: some proxies lose a status that comes
  /// before.
  [[nodiscard]] bool status_due(Clock::time_point now);
  void check_end_of_upload();
  void notice_slow_upload(Clock::time_point now);
  [[nodiscard]] bool uploading() const {
    return upload_ == Upload::awaiting_spec || upload_ == Upload::receiving;
  }
  [[nodiscard]] v1::SmoothResponse accepted_message();

  void report_failure();
  [[nodiscard]] bool deadline_passed() const;

  const Caller caller_;
  const CallPlace place_;
  grpc::ByteBuffer request_;  // gRPC's while it is read
  CallOptions call_;
  MemoryEstimate estimate_;  // validate_only
  Upload upload_ = Upload::awaiting_spec;
  Answer answer_ = Answer::none;
  Input input_ = Input::idle;
  Download download_ = Download::none;
  Clock::time_point last_read_;
  UploadRate upload_rate_;
  std::optional<Clock::time_point> drop_until_;  // for the client to half-close
};

}  // namespace meshsmooth::server
