#include "rpc/attach_reactor.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"
#include "rpc/messages.hpp"
#include "rpc/status.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

constexpr auto kProgressInterval = 100ms;

void check_offset(const Job& job, std::int64_t offset) {
  const std::int64_t size = job.request().layout.coordinates_bytes;
  if (offset >= 0 && offset <= size) return;
  throw Error("RESULT_OFFSET_PAST_END",
              "result_offset_bytes is " + std::to_string(offset) + ", the result has " +
                  std::to_string(size) + " bytes",
              {{"field", "result_offset_bytes"}, {"size_bytes", std::to_string(size)}});
}

}  // namespace

AttachReactor* AttachReactor::start(Engine& engine, grpc::CallbackServerContext* context,
                                    const v1::AttachJobRequest& request, const Entry& entry) {
  auto job = entry.denied ? nullptr : engine.store().find(entry.caller.identity, request.name());
  const std::shared_ptr<AttachReactor> reactor(
      new AttachReactor(engine, context, std::move(job), request.result_offset_bytes()));
  reactor->self_ = reactor;
  reactor->attend(entry.denied);
  reactor->pump();
  return reactor.get();
}

void AttachReactor::attend(const std::exception_ptr& denied) {
  engine_.call_began();
  Attendance attendance;
  std::exception_ptr error;
  try {
    if (denied) std::rethrow_exception(denied);
    if (!job_) throw Error("JOB_NOT_FOUND", "no job of this name is known (any more)");
    check_offset(*job_, sent_bytes_);
    attendance = engine_.attend(job_, [weak = weak_from_this()] {
      if (const auto reactor = weak.lock()) reactor->pump();
    });
  } catch (...) {
    error = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  attendance_ = std::move(attendance);
  if (error) fail(error);
}

void AttachReactor::OnWriteDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (ok && response_.has_chunk()) {
      engine_.metrics().sent(static_cast<std::int64_t>(response_.chunk().data().size()));
    }
    if (!ok) {
      client_gone_ = true;
      fail(std::make_exception_ptr(Cancelled("CANCELLED_BY_CLIENT", "the client is gone")));
    }
  }
  pump();
}

void AttachReactor::OnCancel() {
  {
    const std::lock_guard lock(mutex_);
    client_gone_ = true;
    fail(std::make_exception_ptr(
        Cancelled("CANCELLED_BY_CLIENT", "the client cancelled or is gone")));
  }
  pump();
}

void AttachReactor::OnDone() {
  engine_.leave(attendance_, error_);
  engine_.call_ended();
  self_.reset();
}

void AttachReactor::pump() {
  const auto keep_alive = shared_from_this();
  std::unique_lock lock(mutex_);
  if (std::exchange(pumping_, true)) return;
  leave_if_failed(lock);
  while (!writing_ && !finished_) {
    const auto now = Clock::now();
    JobSnapshot job;
    if (job_) job = job_->snapshot();
    if (!error_) notice_job(job);
    leave_if_failed(lock);
    if (all_sent() && job.state == JobState::sending) {
      lock.unlock();
      job_->end();  // it is not kept, and waited for this
      lock.lock();
      continue;
    }
    if (error_ || output_ == Output::done) {
      finished_ = true;
      const std::exception_ptr error = error_;
      lock.unlock();
      alarm_.reset();
      Finish(error ? to_status(describe_error(error, job_ ? job_->name() : "this call"))
                   : grpc::Status::OK);
      lock.lock();
    } else if (prepare_write(job, now)) {
      writing_ = true;
      write_began_ = now;
      lock.unlock();
      StartWrite(&response_);
      lock.lock();
    } else {
      break;
    }
  }
  // A client that does not read what it is sent holds the result.
  if (writing_ && !client_gone_) {
    const auto idle = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(engine_.config().stream_idle_timeout_seconds));
    if (Clock::now() >= write_began_ + idle) {
      fail(std::make_exception_ptr(DeadlineExceeded("STREAM_IDLE", "the client stopped reading")));
      client_gone_ = true;
      lock.unlock();
      context_->TryCancel();  // nobody else pumps yet, so the call is still there
      lock.lock();
      pumping_ = false;
      lock.unlock();
      return pump();  // what came meanwhile
    } else {
      wake_at(write_began_ + idle);
    }
  }
  pumping_ = false;
}

// Now: a write to a client that is gone may take until TCP gives it up.
void AttachReactor::leave_if_failed(std::unique_lock<std::mutex>& lock) {
  if (!error_ || std::exchange(left_, true)) return;
  result_.reset();
  const std::exception_ptr error = error_;
  lock.unlock();
  engine_.leave(attendance_, error);
  lock.lock();
}

void AttachReactor::notice_job(const JobSnapshot& job) {
  if (!result_) result_ = job.result;
  const std::exception_ptr stop_cause = job_->stop_cause();
  if (job.error) {
    fail(job.error);
  } else if (stop_cause && job.state == JobState::sending) {
    fail(stop_cause);
  } else if (has_ended(job.state) && !result_) {
    fail(std::make_exception_ptr(
        Error("RESULT_NOT_KEPT", "the job has ended and its result is gone")));
  }
}

bool AttachReactor::all_sent() const {
  return output_ == Output::chunks && sent_bytes_ == job_->request().layout.coordinates_bytes;
}

bool AttachReactor::prepare_write(const JobSnapshot& job, Clock::time_point now) {
  if (output_ == Output::chunks) {
    if (all_sent()) {
      *response_.mutable_summary() = encode_job_summary(*job_, job);
      output_ = Output::done;
    } else {
      const auto bytes = result_chunk(*result_, sent_bytes_, engine_.config().result_chunk_bytes);
      v1::Chunk* const chunk = response_.mutable_chunk();
      chunk->set_array_id(v1::ARRAY_ID_COORDINATES);
      chunk->set_offset_bytes(sent_bytes_);
      chunk->set_data(bytes.data(), bytes.size());
      sent_bytes_ += static_cast<std::int64_t>(bytes.size());
    }
    return true;
  }
  if (result_) {
    *response_.mutable_result() = encode_result_header(*job_, job);
    output_ = Output::chunks;
    return true;
  }
  if (job.state == seen_state_ && job.progress_count == seen_progress_count_) return false;
  if (now < next_progress_) {
    wake_at(next_progress_);
    return false;
  }
  seen_state_ = job.state;
  seen_progress_count_ = job.progress_count;
  next_progress_ = now + kProgressInterval;
  *response_.mutable_progress() =
      encode_progress(job, job.state == JobState::queued ? engine_.queue().position(*job_) : 0);
  return true;
}

void AttachReactor::fail(std::exception_ptr error) {
  if (!error_ && !finished_) error_ = std::move(error);
}

void AttachReactor::wake_at(Clock::time_point time) {
  if (alarm_at_ && *alarm_at_ <= time && Clock::now() < *alarm_at_) return;
  alarm_at_ = time;
  alarm_ = std::make_unique<grpc::Alarm>();
  alarm_->Set(
      std::chrono::system_clock::now() +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(time - Clock::now()),
      [weak = weak_from_this()](bool) {
        if (const auto reactor = weak.lock()) reactor->pump();
      });
}

}  // namespace meshsmooth::server
