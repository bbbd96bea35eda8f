#include "rpc/smooth_reactor.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "rpc/status.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

// Faster progress would only cost the lane time.
constexpr auto kMinProgressInterval = 10ms;
constexpr auto kQueuePositionInterval = 100ms;

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::optional<Clock::time_point> call_deadline(const grpc::CallbackServerContext& context) {
  const auto left = context.deadline() - std::chrono::system_clock::now();
  if (left > std::chrono::hours(24 * 365)) return std::nullopt;
  return Clock::now() + left;
}

v1::SmoothResponse stop_sending_message() {
  v1::SmoothResponse message;
  message.mutable_stop_sending();
  return message;
}

// The states in which it is for a call to end the job.
bool is_our_turn(JobState state) {
  return state == JobState::receiving || state == JobState::sending;
}

}  // namespace

SmoothReactor* SmoothReactor::start(Engine& engine, grpc::CallbackServerContext* context,
                                    Entry entry) {
  const std::shared_ptr<SmoothReactor> reactor(
      new SmoothReactor(engine, context, std::move(entry)));
  reactor->self_ = reactor;
  reactor->pump();
  return reactor.get();
}

SmoothReactor::SmoothReactor(Engine& engine, grpc::CallbackServerContext* context, Entry entry)
    : engine_(engine),
      context_(context),
      caller_(std::move(entry.caller)),
      error_(std::move(entry.denied)),
      last_read_(Clock::now()),
      upload_rate_(engine.config().min_upload_bytes_per_second,
                   to_duration(engine.config().upload_rate_window_seconds)) {
  if (!error_ && engine_.draining()) error_ = draining_error();
}

void SmoothReactor::OnReadDone(bool ok) {
  std::unique_lock lock(mutex_);
  last_read_ = Clock::now();
  if (!ok) {
    half_closed_ = true;
    // A client that is gone ends its stream too; OnCancel says so.
    if (!error_ && !mesh_complete_ && !call_.validate_only && !context_->IsCancelled()) {
      try {
        if (!job_) throw InvalidOption("SPEC_MISSING", "the stream ended before a spec came");
        if (job_->state() == JobState::receiving) job_->mesh().finish();
      } catch (...) {
        fail(std::current_exception());
      }
    }
  } else if (!error_ && !call_.validate_only) {
    ingesting_ = true;
    lock.unlock();
    std::exception_ptr error;
    try {
      ingest();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    ingesting_ = false;
    if (error) fail(error);
  }
  reading_ = false;
  lock.unlock();
  pump();
}

void SmoothReactor::ingest() {
  if (const auto chunk = wire::find_chunk(request_, v1::SmoothRequest::kChunkFieldNumber)) {
    ingest_chunk(*chunk);
    request_.Clear();  // at once: gRPC's blocks are larger than what is in them
    return;
  }
  v1::SmoothRequest message;
  if (!wire::parse(request_, message)) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "bytes that are no SmoothRequest");
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
  if (attendance_.joined) return;  // the job has its mesh from another call
  if (mesh_complete_) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH", "a chunk came after the last announced byte");
  }
  job_->mesh().add(chunk);
  engine_.metrics().received(static_cast<std::int64_t>(chunk.size_bytes));
  const bool complete = job_->mesh().complete();
  const std::lock_guard lock(mutex_);
  upload_rate_.add(static_cast<std::int64_t>(chunk.size_bytes), Clock::now());
  if (complete) mesh_complete_ = true;
}

void SmoothReactor::ingest_spec(const v1::JobSpec& spec) {
  if (job_) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "spec: it came twice", {{"field", "spec"}});
  }
  DecodedSpec decoded = decode_spec(spec, caller_.identity, engine_);
  decoded.job.traceparent = caller_.traceparent;
  decoded.job.connection = caller_.connection;
  decoded.job.deadline = call_deadline(*context_);
  MemoryEstimate estimate;
  Attendance attendance;
  if (decoded.call.validate_only) {
    estimate = engine_.estimate(decoded.job);
  } else {
    attendance = engine_.admit(std::move(decoded.job), [weak = weak_from_this()] {
      if (const auto reactor = weak.lock()) reactor->pump();
    });
    engine_.call_began();
  }
  const std::lock_guard lock(mutex_);
  job_ = attendance.job;
  attendance_ = std::move(attendance);
  mesh_complete_ = submitted_ = attendance_.joined;
  estimate_ = estimate;
  call_ = decoded.call;
  if (job_) upload_rate_.start(Clock::now());
  output_ = Output::accepted;
}

void SmoothReactor::OnWriteDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (ok) engine_.metrics().sent(written_positions_);
    written_positions_ = 0;
    response_.Clear();
    if (!ok && !client_gone_) {
      client_gone_ = true;
      fail(std::make_exception_ptr(Cancelled("CANCELLED_BY_CLIENT", "the client is gone")));
    }
  }
  pump();
}

void SmoothReactor::OnCancel() {
  {
    const std::lock_guard lock(mutex_);
    client_gone_ = true;
    if (deadline_passed()) {
      const bool running = job_ && job_->snapshot().times.started;
      fail(std::make_exception_ptr(
          running ? DeadlineExceeded("DEADLINE_RUNNING",
                                     "the deadline passed while the job was running")
                  : DeadlineExceeded("DEADLINE_IN_QUEUE",
                                     "the deadline passed before the job could run")));
    } else {
      fail(std::make_exception_ptr(
          Cancelled("CANCELLED_BY_CLIENT", "the client cancelled or is gone")));
    }
  }
  pump();
}

void SmoothReactor::OnDone() {
  if (job_) {
    engine_.leave(attendance_, error_);
    engine_.call_ended();
  }
  self_.reset();
}

void SmoothReactor::on_timer(int generation) {
  {
    const std::lock_guard lock(mutex_);
    if (generation != alarm_generation_) return;
    alarm_at_.reset();
  }
  pump();
}

void SmoothReactor::pump() {
  const auto keep_alive = shared_from_this();
  std::unique_lock lock(mutex_);
  // Whoever pumps looks again after each step, so it will see what changed.
  if (pumping_) return;
  pumping_ = true;
  for (Step step = next_step(); step != Step::none; step = next_step()) {
    lock.unlock();
    perform(step);
    lock.lock();
  }
  pumping_ = false;
}

void SmoothReactor::perform(Step step) {
  switch (step) {
    case Step::none:
      return;
    case Step::read:
      return StartRead(&request_);
    case Step::write:
      return StartWrite(&response_, write_options_);
    case Step::submit_job:
      return engine_.submit(job_);
    case Step::leave_job:
      return engine_.leave(attendance_, error_);
    case Step::expire_job:
      return engine_.end_waiting(*job_, queue_timeout_error());
    case Step::succeed_job:
      job_->end();
      return;
    case Step::arm_timer: {
      auto alarm = std::make_unique<grpc::Alarm>();
      const auto delay = *alarm_at_ - Clock::now();
      alarm->Set(std::chrono::system_clock::now() +
                     std::chrono::duration_cast<std::chrono::system_clock::duration>(delay),
                 [weak = weak_from_this(), generation = alarm_generation_](bool) {
                   if (const auto reactor = weak.lock()) reactor->on_timer(generation);
                 });
      alarm_ = std::move(alarm);
      return;
    }
    case Step::abort:
      return context_->TryCancel();
    case Step::finish:
      alarm_.reset();
      if (error_ && !job_) {
        engine_.metrics().refused(error_);
        log_refused(error_, caller_.traceparent);
      }
      Finish(error_ ? to_status(describe_error(error_, job_ ? job_->name() : "this call"))
                    : grpc::Status::OK);
      return;
  }
}

SmoothReactor::Step SmoothReactor::next_step() {
  if (finished_) return Step::none;
  const auto now = Clock::now();
  wake_.reset();
  JobSnapshot job;
  if (job_) {
    job = job_->snapshot();
    notice_job(job);
  }
  notice_idle_client(now);

  if (error_) {
    // Now: a write to a client that is gone may take until TCP gives it up.
    result_.reset();
    if (job_ && !ingesting_ && !std::exchange(left_, true)) return Step::leave_job;
    if (client_stalled_ && !std::exchange(aborted_, true)) return Step::abort;
    return next_step_of_failure(now);
  }

  if (mesh_complete_ && !submitted_) {
    submitted_ = true;
    return Step::submit_job;
  }
  if (!writing_) {
    if (output_ == Output::done || (call_.validate_only && output_ == Output::progress)) {
      finished_ = true;
      return Step::finish;
    }
    if (output_ == Output::chunks && sent_bytes_ == job_->request().layout.coordinates_bytes) {
      output_ = Output::summary;
      return Step::succeed_job;
    }
    if (prepare_write(job, now)) {
      write_began_ = now;
      writing_ = true;
      return Step::write;
    }
  }
  if (job_ && job.state == JobState::queued && job_->request().queue_timeout) {
    const auto expires = *job.times.queued + *job_->request().queue_timeout;
    if (now >= expires) return Step::expire_job;
    wake_at(expires);
  }
  return next_step_of_waiting();
}

SmoothReactor::Step SmoothReactor::next_step_of_failure(Clock::time_point now) {
  if (client_gone_) {
    if (writing_ || ingesting_) return Step::none;
    finished_ = true;
    return Step::finish;
  }
  if (!writing_) {
    if (!half_closed_ && !stop_sending_written_) {
      response_ = wire::encode(stop_sending_message());
      write_options_ = {};
      stop_sending_written_ = true;
      drop_until_ = now + to_duration(engine_.config().drop_timeout_seconds);
      write_began_ = now;
      writing_ = true;
      return Step::write;
    }
    if (half_closed_ || now >= drop_until_) {
      if (ingesting_) return Step::none;
      finished_ = true;
      return Step::finish;
    }
    wake_at(drop_until_);
  }
  return next_step_of_waiting();
}

SmoothReactor::Step SmoothReactor::next_step_of_waiting() {
  if (!reading_ && !half_closed_) {
    reading_ = true;
    return Step::read;
  }
  if (wake_ && (!alarm_at_ || *wake_ + 1ms < *alarm_at_)) {
    alarm_at_ = wake_;
    ++alarm_generation_;
    return Step::arm_timer;
  }
  return Step::none;
}

// A job that failed, or that someone asked us to end, fails the call.
void SmoothReactor::notice_job(const JobSnapshot& job) {
  if (!result_ && !error_) result_ = job.result;
  const std::exception_ptr stop_cause = job_->stop_cause();
  if (attendance_.joined && job.error && !job.times.queued && !stop_cause) {
    fail(std::make_exception_ptr(Error(
        "UPLOAD_LOST", "the call that brought the mesh ended before it was complete; send it")));
  } else if (job.error) {
    fail(job.error);
  } else if (stop_cause && is_our_turn(job.state)) {
    fail(stop_cause);
  } else if (has_ended(job.state) && !result_) {
    fail(std::make_exception_ptr(
        Error("RESULT_NOT_KEPT", "the job has ended and its result is gone")));
  }
}

// An upload that pauses, or a client that does not read what it is sent: each
// would hold memory for as long as it likes.
void SmoothReactor::notice_idle_client(Clock::time_point now) {
  const ServerConfig& config = engine_.config();
  const auto idle_timeout = to_duration(config.stream_idle_timeout_seconds);
  if (!error_ && !mesh_complete_ && !call_.validate_only) {
    const auto idle_at = last_read_ + idle_timeout;
    if (now >= idle_at) {
      fail(std::make_exception_ptr(
          DeadlineExceeded("STREAM_IDLE", "the upload paused for too long")));
    } else {
      wake_at(idle_at);
    }
    if (const auto slow_at = upload_rate_.deadline(); slow_at && now >= *slow_at) {
      fail(std::make_exception_ptr(DeadlineExceeded(
          "UPLOAD_TOO_SLOW", "the upload was slower than " +
                                 std::to_string(config.min_upload_bytes_per_second) +
                                 " bytes per second")));
    } else if (slow_at) {
      wake_at(*slow_at);
    }
  }
  if (writing_ && !client_gone_) {
    const auto stalled_at =
        write_began_ + (error_ ? to_duration(config.drop_timeout_seconds) : idle_timeout);
    if (now >= stalled_at) {
      client_stalled_ = true;
      fail(std::make_exception_ptr(DeadlineExceeded("STREAM_IDLE", "the client stopped reading")));
    } else {
      wake_at(stalled_at);
    }
  }
}

bool SmoothReactor::prepare_write(const JobSnapshot& job, Clock::time_point now) {
  v1::SmoothResponse message;
  write_options_ = {};
  switch (output_) {
    case Output::accepted:
      response_ = wire::encode(accepted_message());
      output_ = attendance_.joined ? Output::stop_sending : Output::progress;
      return true;
    case Output::stop_sending:
      response_ = wire::encode(stop_sending_message());
      output_ = Output::progress;
      return true;
    case Output::progress:
      if (!result_) return prepare_progress(job, now);
      *message.mutable_result() = encode_result_header(*job_, job);
      response_ = wire::encode(message);
      write_options_.set_buffer_hint();  // it goes with the first chunk
      output_ = Output::chunks;
      return true;
    case Output::chunks:
      prepare_chunk();
      return true;
    case Output::summary:
      *message.mutable_summary() = encode_job_summary(*job_, job);
      response_ = wire::encode(message);
      output_ = Output::done;
      return true;
    case Output::nothing:
    case Output::done:
      return false;
  }
  __builtin_unreachable();
}

v1::SmoothResponse SmoothReactor::accepted_message() {
  v1::SmoothResponse message;
  v1::Accepted* accepted = message.mutable_accepted();
  if (job_) {
    *accepted->mutable_job() = encode_job(*job_, engine_);
    estimate_ = job_->reserved_bytes();
    estimate_.host_bytes += attendance_.stream.bytes().host_bytes;
  }
  if (job_) accepted->set_topology_name(job_->snapshot().topology_name);
  accepted->set_host_reserved_bytes(estimate_.host_bytes);
  accepted->set_device_reserved_bytes(estimate_.device_bytes);
  return message;
}

bool SmoothReactor::prepare_progress(const JobSnapshot& job, Clock::time_point now) {
  if (!call_.progress_interval || !submitted_) return false;
  const int position = job.state == JobState::queued ? engine_.queue().position(*job_) : 0;
  const bool news = job.state != seen_state_ || job.progress_count != seen_progress_count_ ||
                    position != seen_position_;
  if (!news) {
    if (job.state == JobState::queued) wake_at(now + kQueuePositionInterval);
    return false;
  }
  if (now < next_progress_) {
    wake_at(next_progress_);
    return false;
  }
  v1::SmoothResponse message;
  *message.mutable_progress() = encode_progress(job, position);
  response_ = wire::encode(message);
  seen_state_ = job.state;
  seen_progress_count_ = job.progress_count;
  seen_position_ = position;
  next_progress_ = now + std::clamp<std::chrono::nanoseconds>(*call_.progress_interval,
                                                              kMinProgressInterval, 1h);
  return true;
}

void SmoothReactor::prepare_chunk() {
  const auto chunk = result_chunk(*result_, sent_bytes_, call_.result_chunk_bytes);
  response_ = wire::encode_chunk(v1::SmoothResponse::kChunkFieldNumber, v1::ARRAY_ID_COORDINATES,
                                 sent_bytes_, chunk);
  written_positions_ = static_cast<std::int64_t>(chunk.size());
  sent_bytes_ += written_positions_;
}

void SmoothReactor::wake_at(Clock::time_point time) {
  if (!wake_ || time < *wake_) wake_ = time;
}

void SmoothReactor::fail(std::exception_ptr error) {
  if (!error_ && !finished_) error_ = std::move(error);
}

bool SmoothReactor::deadline_passed() const {
  return context_->deadline() <= std::chrono::system_clock::now();
}

}  // namespace meshsmooth::server
