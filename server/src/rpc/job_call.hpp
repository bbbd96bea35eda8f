#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <utility>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/error.hpp"
#include "rpc/call_loop.hpp"
#include "rpc/result_stream.hpp"
#include "rpc/status.hpp"
#include "rpc/stream_message.hpp"

namespace meshsmooth::server {

/// A streaming call that sends the result of a job: its part in the job, what it writes, and how
/// it ends. `Reactor` is the gRPC reactor, `Response` its message.
template <class Reactor, class Response>
class JobCall : public CallLoop<Reactor> {
 protected:
  using Loop = CallLoop<Reactor>;
  using typename Loop::Action;

  /// Whether somebody still reads what is written. `aborted`: stalled, and the call is cancelled.
  enum class Client { present, stalled, aborted, gone };
  enum class Ending { none, told_to_stop, finished };

  JobCall(Engine& engine, grpc::CallbackServerContext* context)
      : engine_(engine), context_(context) {}
  ~JobCall() = default;

  // --- events ----------------------------------------------------------------------

  void write_done(bool ok) {
    {
      const std::lock_guard lock(this->mutex_);
      this->write_ended();
      if (ok) engine_.metrics().sent(written_positions_);
      written_positions_ = 0;
      response_.Clear();
      if (!ok && client_ != Client::gone) {
        client_ = Client::gone;
        fail(std::make_exception_ptr(Cancelled("CANCELLED_BY_CLIENT", "the client is gone")));
      }
    }
    this->pump();
  }

  void client_gone(std::exception_ptr error) {
    {
      const std::lock_guard lock(this->mutex_);
      client_ = Client::gone;
      fail(std::move(error));
    }
    this->pump();
  }

  // --- with the lock ---------------------------------------------------------------

  /// The call ends by the first error.
  void fail(std::exception_ptr error) {
    if (!error_ && ending_ != Ending::finished) error_ = std::move(error);
  }

  /// A job that failed, or that someone asked us to end, fails the call.
  JobSnapshot notice_job() {
    if (!job_) return {};
    JobSnapshot now = job_->snapshot();
    if (!error_) fail(result_stream_->notice(now));
    return now;
  }

  /// A client that stops reading would pin memory indefinitely.
  void notice_stalled_client(Clock::time_point now) {
    const ServerConfig& config = engine_.config();
    if (client_ != Client::present) return;
    if (!this->write_stalled(now, error_ ? config.drop_timeout : config.stream_idle_timeout))
      return;
    client_ = Client::stalled;
    fail(std::make_exception_ptr(DeadlineExceeded("STREAM_IDLE", "the client stopped reading")));
  }

  /// First of all once the call has failed: a write to a client that is gone may take until TCP
  /// gives it up, and must not hold the result for so long.
  Action next_cleanup(bool job_in_use) {
    if (result_stream_) result_stream_->release();
    if (subscription_.job && !job_in_use) return [this] { engine_.leave(subscription_, error_); };
    if (client_ == Client::stalled) {
      client_ = Client::aborted;
      return [this] { context_->TryCancel(); };
    }
    return {};
  }

  Action next_of_stream(const JobSnapshot& job, Clock::time_point now) {
    const int position =
        result_stream_->needs_queue_position(job) ? engine_.queue().position(*job_) : 0;
    const ResultStream::Step step = result_stream_->next(job, position, now);
    if (step.wake) this->wake_at(*step.wake);
    switch (step.action) {
      case ResultStream::Action::wait:
        return {};
      case ResultStream::Action::complete_job:
        return [this] { engine_.complete(*job_); };
      case ResultStream::Action::send_summary:
        return reactor().write_summary(encode_step<Response>(step, *job_, job, position), now);
      default:
        written_positions_ = static_cast<std::int64_t>(step.data.size());
        return write(encode_step<Response>(step, *job_, job, position), now,
                     step.action == ResultStream::Action::send_header);
    }
  }

  /// `buffered`: it may wait for the next message, but not the first one: the call's metadata would
  /// wait with it until the client's keepalive.
  Action write(grpc::ByteBuffer message, Clock::time_point now, bool buffered = false) {
    response_ = std::move(message);
    write_options_ = {};
    if (buffered && wrote_) write_options_.set_buffer_hint();
    wrote_ = true;
    this->write_begins(now);
    return [this] { reactor().StartWrite(&response_, write_options_); };
  }

  /// With the status OK. Nobody notices a client that does not take them, so the call leaves its
  /// job first.
  Action write_and_finish(grpc::ByteBuffer message) {
    response_ = std::move(message);
    ending_ = Ending::finished;
    return [this] {
      this->cancel_alarm();
      engine_.leave(subscription_, nullptr);
      reactor().StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK);
    };
  }

  Action finish() {
    ending_ = Ending::finished;
    return [this] {
      this->cancel_alarm();
      if (error_) reactor().report_failure();
      reactor().Finish(error_ ? to_status(describe_error(error_, job_ ? job_->name() : "this call"))
                              : grpc::Status::OK);
    };
  }

  Engine& engine_;
  grpc::CallbackServerContext* const context_;
  std::exception_ptr error_;  // the first; the call ends by it
  std::shared_ptr<Job> job_;
  Subscription subscription_;                  // in that job, until the call leaves it
  std::optional<ResultStream> result_stream_;  // with a job
  Client client_ = Client::present;
  Ending ending_ = Ending::none;

 private:
  Reactor& reactor() { return static_cast<Reactor&>(*this); }

  grpc::ByteBuffer response_;           // gRPC's while it is written
  grpc::WriteOptions write_options_;    // of response_
  std::int64_t written_positions_ = 0;  // bytes of the result in response_
  bool wrote_ = false;                  // a message
};

}  // namespace meshsmooth::server
