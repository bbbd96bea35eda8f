#include "meshsmooth/client.hpp"

#include <google/protobuf/empty.pb.h>
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <future>
#include <utility>

#include "attach_call.hpp"
#include "channel.hpp"
#include "client_access.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "request_id.hpp"
#include "retry.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"
#include "spare_memory.hpp"
#include "wire/codec.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::client {
namespace {

/// For calls that only ask or tell.
constexpr std::chrono::seconds kShortTimeout{30};

constexpr std::array<std::string_view, 9> kJobStateNames = {"unspecified", "receiving", "queued",
                                                            "running",     "sending",   "succeeded",
                                                            "failed",      "cancelled", "expired"};

std::string json_of(const google::protobuf::Message& answer) {
  if (!wire::has_json(answer)) {
    throw broken_answer("the server's answer has a duration or a time that is none");
  }
  return wire::to_json(answer);
}

JobInfo decode_job(const v1::Job& job) {
  JobInfo info;
  info.name = job.name();
  info.request_id = job.request_id();
  info.progress = decode_progress(job.last_progress());
  info.progress.queue_position = job.queue_position();
  info.state =
      v1::State_IsValid(job.state()) ? static_cast<JobState>(job.state()) : JobState::unspecified;
  info.node_count = job.node_count();
  info.element_count = job.element_count();
  if (job.has_error()) info.error = job.error().reason() + ": " + job.error().message();
  info.json = json_of(job);
  return info;
}

}  // namespace

struct Client::Impl {
  Impl(std::shared_ptr<grpc::Channel> its_channel, std::string its_name)
      : channel(std::move(its_channel)),
        stub(v1::SmoothingService::NewStub(channel)),
        name(std::move(its_name)) {}

  /// Runs one of the stub's unary calls.
  template <class Response, class Request>
  Response call(grpc::Status (v1::SmoothingService::Stub::*method)(grpc::ClientContext*,
                                                                   const Request&, Response*),
                const Request& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kShortTimeout);
    Response response;
    const grpc::Status status = (stub.get()->*method)(&context, request, &response);
    if (!status.ok()) throw error(status, kShortTimeout);
    return response;
  }

  [[nodiscard]] ServiceError error(const grpc::Status& status,
                                   std::chrono::duration<double> timeout) const {
    return to_service_error(
        status, {.server = name, .cancelled_by_caller = false, .timeout_seconds = timeout.count()});
  }

  /// A job, as often as it takes.
  SmoothReport smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request,
                      TopologyUse topology) {
    RequestOptions attempt = request;
    if (attempt.request_id.empty()) attempt.request_id = make_request_id();
    Retry retry(attempt, request.timeout.value_or(default_timeout(mesh, options)));
    std::size_t early_bytes = last_was_accepted ? kManyEarlyBytes : kFewEarlyBytes;
    BorrowedMemory memory(spare, mesh);
    for (;;) {
      SmoothCall call(channel, name, mesh, options, attempt, retry.left(), early_bytes, topology,
                      memory.places);
      try {
        SmoothReport report = call.run();
        last_was_accepted = true;
        return report;
      } catch (const ServiceError& error) {
        last_was_accepted = false;
        // The server said itself that it cannot: a proxy may take another.
        if (!error.reason().empty()) topology.route.clear();
        // Cut off with much under way: what a proxy may have said is heard with less.
        const bool unheard =
            std::exchange(early_bytes, kFewEarlyBytes) == kManyEarlyBytes && !call.answered();
        if (!unheard || !error.reason().empty() || retry.left().count() <= 0) retry.wait(error);
      }
    }
  }

  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SmoothingService::Stub> stub;
  std::string name;
  /// Whether the last job succeeded: a server is behind the channel, and takes jobs.
  std::atomic<bool> last_was_accepted = false;
  SpareMemory spare;
};

struct Session::Impl {
  Impl(Client::Impl& its_client, const Mesh& its_mesh)
      : client(its_client),
        mesh(its_mesh),
        node_count(mesh.node_count()),
        topology_name(wire::topology_name(MeshTopology(mesh).view())),
        route(topology_name.substr(topology_name.rfind('-') + 1)) {}

  template <class Real>
  SmoothReport smooth(std::span<Vec3<Real>> positions, const SmoothOptions& options,
                      const RequestOptions& request) {
    if (positions.size() != node_count) {
      throw ServiceError(StatusCode::invalid_argument, "ARRAY_SIZE_MISMATCH",
                         std::to_string(positions.size()) + " positions for a mesh of " +
                             std::to_string(node_count) + " nodes",
                         {}, {});
    }
    using Own = std::vector<Vec3<Real>>;
    if (!std::holds_alternative<Own>(mesh.positions)) mesh.positions.emplace<Own>();
    auto& own = std::get<Own>(mesh.positions);
    own.assign(positions.begin(), positions.end());
    SmoothReport report;
    const auto begin = std::chrono::steady_clock::now();
    try {
      report = client.smooth(mesh, options, request, {topology_name, false, route});
    } catch (const ServiceError& error) {
      if (error.reason() != "TOPOLOGY_NOT_FOUND") throw;
      RequestOptions rest = request;
      if (rest.timeout) *rest.timeout -= std::chrono::steady_clock::now() - begin;
      report = client.smooth(mesh, options, rest, {{}, true, route});
    }
    std::copy(own.begin(), own.end(), positions.begin());
    return report;
  }

  Client::Impl& client;
  Mesh mesh;  // its positions are those of the last job
  const std::size_t node_count;
  std::string topology_name;
  std::string route;
};

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

const std::string& Session::topology_name() const { return impl_->topology_name; }

SmoothReport Session::smooth(std::span<Vec3d> positions, const SmoothOptions& options,
                             const RequestOptions& request) {
  return impl_->smooth(positions, options, request);
}

SmoothReport Session::smooth(std::span<Vec3f> positions, const SmoothOptions& options,
                             const RequestOptions& request) {
  return impl_->smooth(positions, options, request);
}

std::string_view job_state_name(JobState state) {
  return kJobStateNames[static_cast<std::size_t>(state)];
}

Client ClientAccess::make(std::shared_ptr<grpc::Channel> channel, const std::string& name) {
  return Client(std::make_unique<Client::Impl>(std::move(channel), name));
}

Client::Client(const std::string& target, const Credentials& credentials)
    : impl_(std::make_unique<Impl>(open_channel(target, credentials), target)) {}
Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

SmoothReport Client::smooth(Mesh& mesh, const SmoothOptions& options,
                            const RequestOptions& request) {
  return impl_->smooth(mesh, options, request, {});
}

Session Client::open(const Mesh& mesh) {
  return Session(std::make_unique<Session::Impl>(*impl_, mesh));
}

SmoothReport Client::attach(const std::string& job_name, Mesh& mesh,
                            const RequestOptions& request) {
  return AttachCall(*impl_->stub, impl_->name, job_name, mesh, request).run();
}

ServerInfo Client::server_info() {
  const auto response =
      impl_->call(&v1::SmoothingService::Stub::GetServerInfo, v1::GetServerInfoRequest());
  return {.version = response.server_version(),
          .build_commit = response.build_commit(),
          .methods = {response.methods().begin(), response.methods().end()},
          .features = {response.features().begin(), response.features().end()},
          .draining = response.draining(),
          .json = json_of(response)};
}

std::vector<JobInfo> Client::list_jobs() {
  std::vector<JobInfo> jobs;
  v1::ListJobsRequest request;
  do {
    const auto response = impl_->call(&v1::SmoothingService::Stub::ListJobs, request);
    for (const v1::Job& job : response.jobs()) jobs.push_back(decode_job(job));
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  return jobs;
}

JobInfo Client::get_job(const std::string& name) {
  v1::GetJobRequest request;
  request.set_name(name);
  return decode_job(impl_->call(&v1::SmoothingService::Stub::GetJob, request).job());
}

JobInfo Client::cancel_job(const std::string& name, bool keep_result) {
  v1::CancelJobRequest request;
  request.set_name(name);
  request.set_result_kept(keep_result);
  return decode_job(impl_->call(&v1::SmoothingService::Stub::CancelJob, request).job());
}

void Client::delete_job(const std::string& name) {
  v1::DeleteJobRequest request;
  request.set_name(name);
  impl_->call(&v1::SmoothingService::Stub::DeleteJob, request);
}

bool Client::healthy(std::chrono::milliseconds timeout) {
  // The two messages of grpc.health.v1, which gRPC's packages do not ship, look
  // on the wire like these well-known ones: a request for the whole server is
  // empty, the answer's only field is number 1, an enum.
  using HealthStub =
      grpc::TemplatedGenericStub<google::protobuf::Empty, google::protobuf::Int32Value>;
  constexpr int kServing = 1;
  HealthStub stub(impl_->channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  const google::protobuf::Empty request;
  google::protobuf::Int32Value response;
  std::promise<grpc::Status> done;
  stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", grpc::StubOptions(), &request, &response,
                 [&done](grpc::Status status) { done.set_value(std::move(status)); });
  const grpc::Status status = done.get_future().get();
  if (!status.ok()) throw impl_->error(status, timeout);
  return response.value() == kServing;
}

}  // namespace meshsmooth::client
