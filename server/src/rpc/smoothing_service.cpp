#include "rpc/smoothing_service.hpp"

#include <algorithm>
#include <charconv>
#include <exception>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "rpc/attach_reactor.hpp"
#include "rpc/job_messages.hpp"
#include "rpc/messages.hpp"
#include "rpc/server_info.hpp"
#include "rpc/smooth_reactor.hpp"
#include "rpc/status.hpp"
#include "wire/codec.hpp"
#include "wire/local_address.hpp"
#include "wire/raw_message.hpp"

namespace meshsmooth::server {
namespace {

// A page token is the sequence number of the last job of the page before.
std::int64_t decode_page_token(const std::string& token) {
  if (token.empty()) return std::numeric_limits<std::int64_t>::max();
  std::int64_t before = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), before);
  if (error != std::errc{} || end != token.data() + token.size()) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "page_token: not from this server",
                        {{"field", "page_token"}});
  }
  return before;
}

std::size_t decode_page_size(int page_size) {
  if (page_size < 0) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "page_size: negative", {{"field", "page_size"}});
  }
  // A job takes up to 6 kB, an answer at most 4 MiB.
  constexpr int kLargestPage = 200;
  return page_size == 0 ? 50 : static_cast<std::size_t>(std::min(page_size, kLargestPage));
}

// Nobody else could open the socket: its segment would only wait for the ticket to expire.
bool is_on_this_host(const Caller& caller) {
  const std::string& connection = caller.connection;  // "ipv4:127.0.0.1:1234"
  return connection.empty() || wire::is_local_address(connection.substr(connection.find(':') + 1));
}

using RawBidiReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;
using RawWriteReactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

/// Ends a call at once.
template <class Reactor>
class RefusedCall final : public Reactor {
 public:
  explicit RefusedCall(const std::exception_ptr& error) {
    this->Finish(to_status(describe_error(error, "this call")));
  }

 private:
  void OnDone() override { delete this; }
  void OnCancel() override {}
};

/// The unary calls whose answers clients have not taken. Thread-safe.
class UnaryCalls {
 public:
  /// A call keeps its answer's place until gRPC is done with it; owns itself.
  class Call final : public grpc::ServerUnaryReactor {
   public:
    Call(UnaryCalls& calls, grpc::CallbackServerContext* context)
        : calls_(calls), context_(context), place_in_list_(calls.add(this)) {}
    void keep(CallPlace place) { place_ = std::move(place); }
    void hold_answer(std::int64_t bytes) { place_.hold_answer(bytes); }

   private:
    friend class UnaryCalls;
    void OnDone() override {
      calls_.remove(place_in_list_);
      delete this;
    }
    void OnCancel() override {}

    UnaryCalls& calls_;
    grpc::CallbackServerContext* const context_;
    const Clock::time_point began_ = Clock::now();
    CallPlace place_;
    const std::list<Call*>::iterator place_in_list_;  // the last: `add` makes it visible
  };

  explicit UnaryCalls(Clock::duration timeout) : timeout_(timeout) {}

 private:
  std::list<Call*>::iterator add(Call* call) {
    const std::lock_guard lock(mutex_);
    // Who leaves an answer unread for so long will not read it. Without new calls none pile up.
    if (!calls_.empty() && Clock::now() - calls_.front()->began_ >= timeout_) {
      calls_.front()->context_->TryCancel();
    }
    return calls_.insert(calls_.end(), call);
  }
  void remove(std::list<Call*>::iterator place) {
    const std::lock_guard lock(mutex_);
    calls_.erase(place);
  }

  const Clock::duration timeout_;
  std::recursive_mutex mutex_;  // TryCancel may end the call at once
  std::list<Call*> calls_;      // the oldest first
};

/// v1::SmoothingService::CallbackService, but with raw messages: Smooth and AttachJob find chunks
/// in them without copies, and of bytes that are no message gRPC itself would say nothing but
/// UNIMPLEMENTED.
using SmoothingServiceBase = v1::SmoothingService::WithRawCallbackMethod_Smooth<
    v1::SmoothingService::WithRawCallbackMethod_GetTopology<
        v1::SmoothingService::WithRawCallbackMethod_DeleteTopology<
            v1::SmoothingService::WithRawCallbackMethod_GetJob<
                v1::SmoothingService::WithRawCallbackMethod_ListJobs<
                    v1::SmoothingService::WithRawCallbackMethod_CancelJob<
                        v1::SmoothingService::WithRawCallbackMethod_AttachJob<
                            v1::SmoothingService::WithRawCallbackMethod_DeleteJob<
                                v1::SmoothingService::WithRawCallbackMethod_LeaseSharedMemory<
                                    v1::SmoothingService::WithRawCallbackMethod_GetServerInfo<
                                        v1::SmoothingService::Service>>>>>>>>>>;

/// Calls that are not overridden return UNIMPLEMENTED.
class SmoothingService final : public SmoothingServiceBase {
 public:
  SmoothingService(Engine& engine, const Authenticator& authenticator)
      : engine_(engine),
        authenticator_(authenticator),
        unary_calls_(engine.config().stream_idle_timeout) {}

  RawBidiReactor* Smooth(grpc::CallbackServerContext* context) override {
    AuthResult auth = authenticator_.authenticate(*context);
    if (auth.over_limit) return new RefusedCall<RawBidiReactor>(auth.over_limit);
    return SmoothReactor::start(engine_, context, std::move(auth));
  }

  grpc::ServerUnaryReactor* GetTopology(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* bytes,
                                        grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::GetTopologyRequest, v1::GetTopologyResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::GetTopologyRequest& request,
            v1::GetTopologyResponse& response) {
          *response.mutable_topology() =
              encode_topology(*find_topology(engine_, caller.name, request.name()));
        });
  }

  grpc::ServerUnaryReactor* DeleteTopology(grpc::CallbackServerContext* context,
                                           const grpc::ByteBuffer* bytes,
                                           grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::DeleteTopologyRequest, v1::DeleteTopologyResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::DeleteTopologyRequest& request,
            v1::DeleteTopologyResponse&) {
          const auto topology = find_topology(engine_, caller.name, request.name());
          engine_.topologies().remove(topology->caller(), topology->name());
        });
  }

  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const grpc::ByteBuffer* bytes,
                                   grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::GetJobRequest, v1::GetJobResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::GetJobRequest& request, v1::GetJobResponse& response) {
          *response.mutable_job() = encode_job(*find_job(caller, request.name()), engine_);
        });
  }

  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* bytes,
                                     grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::ListJobsRequest, v1::ListJobsResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::ListJobsRequest& request,
            v1::ListJobsResponse& response) {
          const std::size_t page_size = decode_page_size(request.page_size());
          const auto wanted = [&](const Job& job) {
            return request.states().empty() ||
                   std::ranges::count(request.states(),
                                      static_cast<int>(wire::encode_enum(job.state()))) > 0;
          };
          const auto jobs = engine_.store().list(
              caller.name, decode_page_token(request.page_token()), page_size + 1, wanted);
          for (std::size_t i = 0; i < std::min(jobs.size(), page_size); ++i) {
            *response.add_jobs() = encode_job(*jobs[i], engine_);
          }
          if (jobs.size() > page_size) {
            response.set_next_page_token(std::to_string(jobs[page_size - 1]->sequence()));
          }
        });
  }

  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* bytes,
                                      grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::CancelJobRequest, v1::CancelJobResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::CancelJobRequest& request,
            v1::CancelJobResponse& response) {
          const std::shared_ptr<Job> job = find_job(caller, request.name());
          if (request.result_kept()) {
            job->finish_early();
          } else {
            engine_.cancel(
                *job, std::make_exception_ptr(Cancelled("CANCELLED_BY_JOB_CALL",
                                                        "the job was cancelled by CancelJob")));
          }
          *response.mutable_job() = encode_job(*job, engine_);
        });
  }

  RawWriteReactor* AttachJob(grpc::CallbackServerContext* context,
                             const grpc::ByteBuffer* request) override {
    AuthResult auth = authenticator_.authenticate(*context);
    if (auth.over_limit) return new RefusedCall<RawWriteReactor>(auth.over_limit);
    return AttachReactor::start(engine_, context, *request, std::move(auth));
  }

  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* bytes,
                                      grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::DeleteJobRequest, v1::DeleteJobResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::DeleteJobRequest& request, v1::DeleteJobResponse&) {
          engine_.forget(*find_job(caller, request.name()));
        });
  }

  grpc::ServerUnaryReactor* LeaseSharedMemory(grpc::CallbackServerContext* context,
                                              const grpc::ByteBuffer* bytes,
                                              grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::LeaseSharedMemoryRequest, v1::LeaseSharedMemoryResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller& caller, const v1::LeaseSharedMemoryRequest& request,
            v1::LeaseSharedMemoryResponse& response) {
          Transport& transport = engine_.transport();
          if (transport.max_bytes() == 0 || !is_on_this_host(caller)) {
            throw NotSupported("OPTION_NOT_SUPPORTED",
                               "this server does not share memory with this caller");
          }
          if (engine_.draining()) std::rethrow_exception(draining_error());
          Transport::Lease lease = transport.lease(caller.name, caller.share, request.size_bytes());
          response.set_segment_name(std::move(lease.name));
          response.set_socket_path(std::move(lease.socket_path));
          response.set_ticket(std::move(lease.ticket));
          response.set_size_bytes(lease.size_bytes);
        });
  }

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const grpc::ByteBuffer* bytes,
                                          grpc::ByteBuffer* answer_bytes) override {
    return answer<v1::GetServerInfoRequest, v1::GetServerInfoResponse>(
        context, *bytes, *answer_bytes,
        [&](const Caller&, const v1::GetServerInfoRequest&, v1::GetServerInfoResponse& response) {
          response = encode_server_info(engine_);
        });
  }

 private:
  /// Answers a unary call at once by `body(caller, request, response)`, or by what it throws.
  template <class Request, class Response, class Body>
  grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context,
                                   const grpc::ByteBuffer& bytes, grpc::ByteBuffer& answer_bytes,
                                   const Body& body) {
    auto* const call = new UnaryCalls::Call(unary_calls_, context);  // until OnDone
    try {
      AuthResult auth = authenticator_.authenticate(*context);
      if (auth.over_limit) std::rethrow_exception(auth.over_limit);
      call->keep(std::move(auth.place));
      if (auth.denied) std::rethrow_exception(auth.denied);
      Request request;
      Response response;
      grpc::ByteBuffer rest = bytes;
      if (!wire::parse(rest, request)) {
        throw NotSupported("OPTION_NOT_SUPPORTED",
                           "cannot parse " + std::string(Request::descriptor()->name()));
      }
      wire::refuse_unknown_fields(request);
      body(auth.caller, request, response);
      answer_bytes = wire::encode(response);
      call->hold_answer(static_cast<std::int64_t>(answer_bytes.Length()));
      call->Finish(grpc::Status::OK);
    } catch (...) {
      call->Finish(to_status(describe_error(std::current_exception(), "this call")));
    }
    return call;
  }

  [[nodiscard]] std::shared_ptr<Job> find_job(const Caller& caller, const std::string& name) const {
    std::shared_ptr<Job> job = engine_.store().find(caller.name, name);
    if (!job) {
      const std::string shown = shown_name(name);
      throw Error("JOB_NOT_FOUND", "job not found or no longer retained: " + shown,
                  {{"name", shown}});
    }
    return job;
  }

  Engine& engine_;
  const Authenticator& authenticator_;
  UnaryCalls unary_calls_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_smoothing_service(Engine& engine,
                                                      const Authenticator& authenticator) {
  return std::make_unique<SmoothingService>(engine, authenticator);
}

}  // namespace meshsmooth::server
