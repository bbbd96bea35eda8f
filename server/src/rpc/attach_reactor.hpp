#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <utility>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "rpc/authenticator.hpp"
#include "rpc/job_call.hpp"

namespace meshsmooth::server {

/// Speaks the protocol of one AttachJob call: progress of a job that exists, then its result.
class AttachReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                            public JobCall<AttachReactor, v1::AttachJobResponse> {
 public:
  /// The reactor of a new call; owns itself until gRPC is done with it.
  static AttachReactor* start(Engine& engine, grpc::CallbackServerContext* context,
                              const grpc::ByteBuffer& request, AuthResult auth);

 private:
  friend CallLoop;
  friend JobCall;

  AttachReactor(Engine& engine, grpc::CallbackServerContext* context, CallPlace place)
      : JobCall(engine, context), place_(std::move(place)) {}

  void OnWriteDone(bool ok) override { write_done(ok); }
  void OnCancel() override;
  void OnDone() override;

  /// Throws why the call cannot attach.
  void attach(const grpc::ByteBuffer& request, const AuthResult& auth);
  Action next_action(Clock::time_point now);  // with the lock
  Action write_summary(grpc::ByteBuffer message, Clock::time_point /*now*/) {
    return write_and_finish(std::move(message));
  }
  void report_failure() {}

  const CallPlace place_;
};

}  // namespace meshsmooth::server
