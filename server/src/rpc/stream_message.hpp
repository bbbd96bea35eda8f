#pragma once

#include <grpcpp/support/byte_buffer.h>

#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "rpc/job_messages.hpp"
#include "rpc/result_stream.hpp"
#include "wire/raw_message.hpp"

namespace meshsmooth::server {

/// The message of a step that sends one, in the response type of a call.
template <class Response>
[[nodiscard]] grpc::ByteBuffer encode_step(const ResultStream::Step& step, const Job& job,
                                           const JobSnapshot& now, int queue_position) {
  if (step.action == ResultStream::Action::send_chunk) {
    return wire::encode_chunk(Response::kChunkFieldNumber, step.array_id, step.offset, step.data);
  }
  Response message;
  if (step.action == ResultStream::Action::send_header) {
    *message.mutable_result() = encode_result_header(job, now, step.in_place);
  } else if (step.action == ResultStream::Action::send_summary) {
    *message.mutable_summary() = encode_job_summary(job, now);
  } else {
    *message.mutable_progress() = encode_progress(now, queue_position);
  }
  return wire::encode(message);
}

}  // namespace meshsmooth::server
