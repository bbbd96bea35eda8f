#include "attach_call.hpp"

#include <grpcpp/client_context.h>

#include <utility>

#include "retry.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"

namespace meshsmooth::client {

AttachCall::AttachCall(v1::SmoothingService::StubInterface& stub, std::string server,
                       std::string job_name, Mesh& mesh, const RequestOptions& request)
    : stub_(stub),
      server_(std::move(server)),
      job_name_(std::move(job_name)),
      mesh_(mesh),
      request_(request),
      result_(mesh.positions_view(), mesh.element_count()) {}

SmoothReport AttachCall::run() {
  Retry retry(request_);
  for (bool done = false; !done;) {
    const std::size_t before = result_.received_bytes();
    try {
      attempt(retry.left());
      done = true;
    } catch (const ServiceError& error) {
      if (result_.received_bytes() > before) retry.succeeded_in_part();
      retry.wait(error);
    }
  }
  if (!summary_) throw broken_answer("the server ended the call without a summary");
  SmoothReport report = decode_report(std::move(*summary_), job_name_, {});
  mesh_.positions = result_.take();
  report.summary.element_quality = result_.take_element_quality();
  return report;
}

void AttachCall::attempt(std::chrono::nanoseconds timeout) {
  grpc::ClientContext context;
  context.set_deadline(time_after<std::chrono::system_clock>(timeout));
  const std::stop_callback cancel_on_stop(request_.stop, [&context] { context.TryCancel(); });
  v1::AttachJobRequest message;
  message.set_name(job_name_);
  message.set_result_offset_bytes(static_cast<std::int64_t>(result_.received_bytes()));
  const auto stream = stub_.AttachJob(&context, message);
  try {
    for (v1::AttachJobResponse response; stream->Read(&response);) handle(response);
  } catch (...) {
    context.TryCancel();
    for (v1::AttachJobResponse dropped; stream->Read(&dropped);) {
    }
    stream->Finish();
    throw;
  }
  const grpc::Status status = stream->Finish();
  if (status.ok()) return;
  throw to_service_error(
      status, {.server = server_,
               .cancelled_by_caller = request_.stop.stop_requested(),
               .timeout_seconds = std::chrono::duration<double>(*request_.timeout).count()});
}

void AttachCall::handle(const v1::AttachJobResponse& response) {
  switch (response.message_case()) {
    case v1::AttachJobResponse::kProgress:
      if (request_.on_progress) request_.on_progress(decode_progress(response.progress()));
      return;
    case v1::AttachJobResponse::kResult:
      if (!result_.begun()) result_.begin(response.result());
      return;
    case v1::AttachJobResponse::kChunk:
      return result_.add(wire::ChunkView(response.chunk()));
    case v1::AttachJobResponse::kSummary:
      summary_ = response.summary();
      return;
    case v1::AttachJobResponse::MESSAGE_NOT_SET:
      return;  // something a newer server adds
  }
}

}  // namespace meshsmooth::client
