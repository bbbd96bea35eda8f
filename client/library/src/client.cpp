#include "meshsmooth/client.hpp"

#include <google/protobuf/empty.pb.h>
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/generic/generic_stub.h>

#include <future>
#include <utility>

#include "attach_call.hpp"
#include "channel.hpp"
#include "client_access.hpp"
#include "client_impl.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::client {
namespace {

std::string json_of(const google::protobuf::Message& answer) {
  if (!wire::has_json(answer)) {
    throw broken_answer("cannot decode the server's answer: invalid duration or timestamp");
  }
  return wire::to_json(answer);
}

JobInfo decode_job(const v1::Job& job) {
  JobInfo info;
  info.name = job.name();
  info.request_id = job.request_id();
  info.progress = decode_progress(job.last_progress());
  info.progress.queue_position = job.queue_position();
  info.state = wire::decode_state(job.state());
  info.node_count = job.node_count();
  info.element_count = job.element_count();
  if (job.has_error()) info.error = job.error().reason() + ": " + job.error().message();
  info.json = json_of(job);
  return info;
}

}  // namespace

Client ClientAccess::make(std::shared_ptr<grpc::Channel> channel, const std::string& name) {
  return Client(std::make_unique<Client::Impl>(std::move(channel), name));
}

Client::Client(const std::string& target, const Credentials& credentials)
    : impl_(std::make_unique<Impl>(open_channel(target, credentials), target)) {}
Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

SmoothReport Client::smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request,
                            const JobInput& input) {
  return impl_->smooth(mesh, options, request, input);
}

SmoothReport Client::attach(const std::string& job_name, Mesh& mesh,
                            const RequestOptions& request) {
  const RequestOptions complete = completed(request, mesh, SmoothOptions());
  return AttachCall(*impl_->stub, impl_->name, job_name, mesh, complete).run();
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

TopologyInfo Client::get_topology(const std::string& name) {
  v1::GetTopologyRequest request;
  request.set_name(name);
  const v1::Topology topology =
      impl_->call(&v1::SmoothingService::Stub::GetTopology, request).topology();
  TopologyInfo info{.name = topology.name(),
                    .node_count = topology.spec().node_count(),
                    .element_count = 0,
                    .boundary_node_count = topology.boundary_node_count(),
                    .resident_bytes = topology.resident_bytes()};
  for (const v1::ElementBlock& block : topology.spec().element_blocks()) {
    info.element_count += block.element_count();
  }
  return info;
}

void Client::delete_topology(const std::string& name) {
  v1::DeleteTopologyRequest request;
  request.set_name(name);
  impl_->call(&v1::SmoothingService::Stub::DeleteTopology, request);
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
