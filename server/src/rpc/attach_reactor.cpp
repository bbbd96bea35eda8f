#include "rpc/attach_reactor.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

constexpr auto kProgressInterval = 100ms;

void check_offset(const Job& job, std::int64_t offset) {
  const std::int64_t size = job.request().result_bytes();
  if (offset >= 0 && offset <= size) return;
  throw Error("RESULT_OFFSET_PAST_END",
              "result_offset_bytes is " + std::to_string(offset) + ", the result has " +
                  std::to_string(size) + " bytes",
              {{"field", "result_offset_bytes"}, {"size_bytes", std::to_string(size)}});
}

}  // namespace

AttachReactor* AttachReactor::start(Engine& engine, grpc::CallbackServerContext* context,
                                    const grpc::ByteBuffer& request, AuthResult auth) {
  std::shared_ptr<AttachReactor> reactor(new AttachReactor(engine, context, std::move(auth.place)));
  engine.call_began();
  try {
    reactor->attach(request, auth);
  } catch (...) {
    const std::lock_guard lock(reactor->mutex_);
    reactor->fail(std::current_exception());
  }
  return CallLoop::start(std::move(reactor));
}

void AttachReactor::attach(const grpc::ByteBuffer& request, const AuthResult& auth) {
  if (auth.denied) std::rethrow_exception(auth.denied);
  v1::AttachJobRequest message;
  grpc::ByteBuffer bytes = request;
  if (!wire::parse(bytes, message)) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "cannot parse AttachJobRequest");
  }
  auto job = engine_.store().find(auth.caller.name, message.name());
  if (!job) throw Error("JOB_NOT_FOUND", "job not found or no longer retained");
  check_offset(*job, message.result_offset_bytes());
  Subscription subscription = engine_.subscribe(job, auth.caller.share, pump_later());
  const std::lock_guard lock(mutex_);
  subscription_ = std::move(subscription);
  result_stream_.emplace(ResultStream::Options{
      .progress_interval = kProgressInterval,
      .report_at_once = true,
      .chunk_bytes = engine_.config().result_chunk_bytes,
      .result_bytes = job->request().result_bytes(),
      .offset = message.result_offset_bytes(),
      .ends_uploads = false,
  });
  job_ = std::move(job);
}

void AttachReactor::OnCancel() {
  client_gone(
      std::make_exception_ptr(Cancelled("CANCELLED_BY_CLIENT", "the client cancelled or is gone")));
}

void AttachReactor::OnDone() {
  engine_.leave(subscription_, error_);
  engine_.call_ended();
  release();
}

AttachReactor::Action AttachReactor::next_action(Clock::time_point now) {
  if (ending_ == Ending::finished) return {};
  const JobSnapshot job = notice_job();
  notice_stalled_client(now);
  if (error_) {
    if (Action cleanup = next_cleanup(false)) return cleanup;
    return writing() ? Action() : finish();
  }
  // Without a stream, `attach` is still under way: the job may call before it returns.
  return writing() || !result_stream_ ? Action() : next_of_stream(job, now);
}

}  // namespace meshsmooth::server
