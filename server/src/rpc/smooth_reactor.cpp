#include "rpc/smooth_reactor.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "busy.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "rpc/job_messages.hpp"

namespace meshsmooth::server {
namespace {

// By which an upload may fall behind while others are refused for lack of memory.
constexpr auto kPatienceWithoutMemory = std::chrono::seconds(2);

std::optional<Clock::time_point> call_deadline(const grpc::CallbackServerContext& context) {
  const auto left = context.deadline() - std::chrono::system_clock::now();
  if (left > std::chrono::hours(24 * 365)) return std::nullopt;
  return Clock::now() + left;
}

grpc::ByteBuffer stop_sending_message() {
  v1::SmoothResponse message;
  message.mutable_stop_sending();
  return wire::encode(message);
}

grpc::ByteBuffer input_taken_message() {
  v1::SmoothResponse message;
  message.mutable_input_taken();
  return wire::encode(message);
}

}  // namespace

SmoothReactor* SmoothReactor::start(Engine& engine, grpc::CallbackServerContext* context,
                                    AuthResult auth) {
  return CallLoop::start(
      std::shared_ptr<SmoothReactor>(new SmoothReactor(engine, context, std::move(auth))));
}

SmoothReactor::SmoothReactor(Engine& engine, grpc::CallbackServerContext* context, AuthResult auth)
    : JobCall(engine, context),
      caller_(std::move(auth.caller)),
      place_(std::move(auth.place)),
      last_read_(Clock::now()),
      upload_rate_(engine.config().min_upload_bytes_per_second,
                   engine.config().upload_rate_window) {
  error_ = std::move(auth.denied);
  if (!error_ && engine.draining()) error_ = draining_error();
}

// --- events ------------------------------------------------------------------------

void SmoothReactor::OnReadDone(bool ok) {
  std::unique_lock lock(mutex_);
  last_read_ = Clock::now();
  if (!ok) {
    input_ = Input::half_closed;
    check_end_of_upload();
  } else {
    if (!error_ && !call_.validate_only) {
      input_ = Input::ingesting;
      lock.unlock();
      std::exception_ptr error;
      try {
        ingest();
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      if (error) fail(error);
    }
    if (!error_ && upload_ == Upload::receiving && call_.transfer->in_place()) {
      lock.unlock();
      const bool goes_on = call_.transfer->upload(
          *job_, [self = shared_from_this()](std::int64_t bytes, const std::exception_ptr& error) {
            self->upload_done(bytes, error);
          });
      if (goes_on) pump();  // the job's admission need not wait for it
      return;
    }
    input_ = Input::idle;
  }
  lock.unlock();
  pump();
}

void SmoothReactor::upload_done(std::int64_t bytes, const std::exception_ptr& error) {
  if (!error) engine_.metrics().received(bytes);
  {
    const std::lock_guard lock(mutex_);
    if (error) fail(error);
    if (job_->mesh().complete()) upload_ = Upload::complete;
    input_ = Input::idle;
  }
  pump();
}

void SmoothReactor::download_done() {
  engine_.metrics().sent(job_->request().result_bytes());
  {
    const std::lock_guard lock(mutex_);
    download_ = Download::done;
  }
  pump();
}

void SmoothReactor::check_end_of_upload() {
  // The stream of a client that is gone ends too; OnCancel tells the difference.
  if (error_ || !uploading() || context_->IsCancelled()) return;
  try {
    if (!job_) throw InvalidOption("SPEC_MISSING", "the stream ended before a spec came");
    if (job_->state() == JobState::receiving) job_->mesh().finish();
  } catch (...) {
    fail(std::current_exception());
  }
}

void SmoothReactor::ingest() {
  if (const auto chunk = wire::find_chunk(request_, v1::SmoothRequest::kChunkFieldNumber)) {
    ingest_chunk(*chunk);
    request_.Clear();  // at once: gRPC's blocks are larger than what is in them
    return;
  }
  v1::SmoothRequest message;
  if (!wire::parse(request_, message)) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "cannot parse SmoothRequest");
  }
  switch (message.message_case()) {
    case v1::SmoothRequest::kSpec:
      return ingest_spec(message.spec());
    case v1::SmoothRequest::kChunk:
      return ingest_chunk(wire::ChunkView(message.chunk()));
    case v1::SmoothRequest::MESSAGE_NOT_SET:
      throw NotSupported("OPTION_NOT_SUPPORTED", "a message that this server does not know");
  }
}

void SmoothReactor::ingest_chunk(const wire::ChunkView& chunk) {
  if (!job_) throw InvalidOption("SPEC_MISSING", "a chunk came before the spec");
  if (subscription_.joined) return;  // another call uploads the mesh
  {
    const std::lock_guard lock(mutex_);
    if (!uploading()) {
      throw InvalidMesh("ARRAY_SIZE_MISMATCH", "a chunk came after the last announced byte");
    }
  }
  const auto bytes = static_cast<std::int64_t>(chunk.size_bytes);
  job_->mesh().add(chunk);
  engine_.metrics().received(bytes);
  const bool complete = job_->mesh().complete();
  const std::lock_guard lock(mutex_);
  upload_rate_.add(bytes, Clock::now());
  if (complete) upload_ = Upload::complete;
}

void SmoothReactor::ingest_spec(const v1::JobSpec& spec) {
  if (job_) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "spec: sent twice", {{"field", "spec"}});
  }
  DecodedSpec decoded = decode_spec(spec, caller_.name, engine_);
  decoded.job.traceparent = caller_.traceparent;
  decoded.job.connection = caller_.connection;
  decoded.job.share = caller_.share;
  decoded.job.deadline = call_deadline(*context_);
  MemoryEstimate estimate;
  Subscription subscription;
  if (decoded.call.validate_only) {
    estimate = engine_.estimate(decoded.job);
  } else {
    subscription = engine_.admit(std::move(decoded.job), pump_later());
    engine_.call_began();
  }
  const std::lock_guard lock(mutex_);
  call_ = decoded.call;
  estimate_ = estimate;
  job_ = subscription.job;
  subscription_ = std::move(subscription);
  upload_ = subscription_.joined || call_.validate_only ? Upload::over : Upload::receiving;
  answer_ = Answer::accepted;
  if (!job_) return;
  result_stream_.emplace(ResultStream::Options{
      .progress_interval = call_.progress_interval,
      .chunk_bytes = call_.result_chunk_bytes,
      .result_bytes = job_->request().result_bytes(),
      .in_place = call_.transfer->in_place(),
      .upload_by_another_call = subscription_.joined,
  });
  const double limit = std::chrono::duration<double>(engine_.config().max_upload_time).count();
  if (limit > 0) {
    upload_rate_.require(static_cast<double>(job_->request().layout.total_bytes()) / limit);
  }
  upload_rate_.start(Clock::now());
}

void SmoothReactor::OnCancel() {
  if (!deadline_passed()) {
    return client_gone(std::make_exception_ptr(
        Cancelled("CANCELLED_BY_CLIENT", "the client cancelled or is gone")));
  }
  std::shared_ptr<Job> job;
  {
    const std::lock_guard lock(mutex_);
    job = job_;
  }
  const bool running = job && job->snapshot().times.started;
  client_gone(std::make_exception_ptr(
      running
          ? DeadlineExceeded("DEADLINE_RUNNING", "the deadline passed while the job was running")
          : DeadlineExceeded("DEADLINE_IN_QUEUE", "the deadline passed before the job could run")));
}

bool SmoothReactor::deadline_passed() const {
  return context_->deadline() <= std::chrono::system_clock::now();
}

void SmoothReactor::OnDone() {
  if (job_) {
    engine_.leave(subscription_, error_);
    engine_.call_ended();
  }
  release();
}

// A call that never became a job would otherwise leave no trace.
void SmoothReactor::report_failure() {
  if (job_) return;
  engine_.metrics().refused(error_);
  log_refused(error_, caller_.traceparent);
}

// --- what to do next, with the lock -------------------------------------------------

SmoothReactor::Action SmoothReactor::next_action(Clock::time_point now) {
  if (ending_ == Ending::finished) return {};
  const JobSnapshot job = notice_job();
  notice_slow_upload(now);
  notice_stalled_client(now);
  if (error_) return next_of_failure(now);

  if (upload_ == Upload::complete) {
    upload_ = Upload::over;
    return [this] { engine_.submit(job_); };
  }
  if (!writing()) {
    if (Action answer = next_answer(job, now)) return answer;
  }
  return next_read();
}

// It is told to stop, and its data are dropped for a while.
SmoothReactor::Action SmoothReactor::next_of_failure(Clock::time_point now) {
  const bool ingesting = input_ == Input::ingesting;
  if (Action cleanup = next_cleanup(ingesting)) return cleanup;
  const bool can_finish = !writing() && !ingesting && download_ != Download::begun;
  if (client_ == Client::gone) return can_finish ? finish() : Action();
  if (!writing()) {
    if (input_ != Input::half_closed && ending_ == Ending::none) {
      ending_ = Ending::told_to_stop;
      return write(stop_sending_message(), now);
    }
    if (status_due(now)) return can_finish ? finish() : Action();
  }
  return next_read();
}

bool SmoothReactor::status_due(Clock::time_point now) {
  if (input_ == Input::half_closed) return true;
  if (!drop_until_) drop_until_ = now + engine_.config().drop_timeout;
  if (now >= *drop_until_) return true;
  wake_at(*drop_until_);
  return false;
}

SmoothReactor::Action SmoothReactor::write_summary(grpc::ByteBuffer message,
                                                   Clock::time_point now) {
  if (input_ == Input::half_closed) return write_and_finish(std::move(message));
  answer_ = Answer::status;
  return write(std::move(message), now);
}

SmoothReactor::Action SmoothReactor::next_answer(const JobSnapshot& job, Clock::time_point now) {
  switch (answer_) {
    case Answer::none:
      return {};
    case Answer::accepted:
      answer_ = subscription_.joined              ? Answer::stop_sending
                : call_.transfer->copies_inputs() ? Answer::input_taken
                                                  : Answer::result;
      return write(wire::encode(accepted_message()), now);
    case Answer::input_taken:
      if (uploading()) return {};
      answer_ = Answer::result;
      return write(input_taken_message(), now);
    case Answer::stop_sending:
      answer_ = Answer::result;
      return write(stop_sending_message(), now);
    case Answer::result:
      if (result_stream_) return next_of_result(job, now);
      answer_ = Answer::status;
      [[fallthrough]];
    case Answer::status:
      return status_due(now) ? finish() : Action();
  }
  __builtin_unreachable();
}

SmoothReactor::Action SmoothReactor::next_of_result(const JobSnapshot& job, Clock::time_point now) {
  if (download_ == Download::begun) return {};
  if (!call_.transfer->in_place() || !job.result || download_ == Download::done) {
    return next_of_stream(job, now);
  }
  download_ = Download::begun;
  return [this, result = job.result] {
    call_.transfer->download(result, [self = shared_from_this()] { self->download_done(); });
  };
}

SmoothReactor::Action SmoothReactor::next_read() {
  if (input_ != Input::idle) return {};
  input_ = Input::reading;
  return [this] { StartRead(&request_); };
}

// An upload that pauses or trickles would pin memory indefinitely.
void SmoothReactor::notice_slow_upload(Clock::time_point now) {
  if (error_ || !uploading()) return;
  const auto idle_at = last_read_ + engine_.config().stream_idle_timeout;
  const bool is_short = engine_.memory_short(now);
  const auto slow_at =
      is_short ? upload_rate_.deadline(kPatienceWithoutMemory) : upload_rate_.deadline();
  if (is_short && slow_at && now >= *slow_at) {
    fail(std::make_exception_ptr(
        Busy("HOST_MEMORY_BUSY", "the upload paused while others found no memory; send it again",
             {}, kPatienceWithoutMemory)));
  } else if (now >= idle_at) {
    fail(
        std::make_exception_ptr(DeadlineExceeded("STREAM_IDLE", "the upload paused for too long")));
  } else if (slow_at && now >= *slow_at) {
    fail(std::make_exception_ptr(
        DeadlineExceeded("UPLOAD_TOO_SLOW", "the upload was slower than " +
                                                std::to_string(upload_rate_.bytes_per_second()) +
                                                " bytes per second")));
  } else {
    wake_at(idle_at);
    if (slow_at) wake_at(*slow_at);
  }
}

v1::SmoothResponse SmoothReactor::accepted_message() {
  v1::SmoothResponse message;
  v1::Accepted* accepted = message.mutable_accepted();
  MemoryEstimate reserved = estimate_;
  if (job_) {
    *accepted->mutable_job() = encode_job(*job_, engine_);
    accepted->set_topology_name(job_->snapshot().topology_name);
    reserved = job_->reserved_bytes();
    reserved.host_bytes += subscription_.stream.bytes().host_bytes;
  }
  accepted->set_host_reserved_bytes(reserved.host_bytes);
  accepted->set_device_reserved_bytes(reserved.device_bytes);
  return message;
}

}  // namespace meshsmooth::server
