#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "client_access.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "wire/status_details.hpp"

namespace meshsmooth::testing {

using ServerStream = grpc::ServerReaderWriter<v1::SmoothResponse, v1::SmoothRequest>;

/// A service whose answers a test writes itself.
class MockService final : public v1::SmoothingService::Service {
 public:
  std::function<grpc::Status(grpc::ServerContext&, ServerStream&)> on_smooth;
  std::function<v1::ListJobsResponse(const v1::ListJobsRequest&)> on_list_jobs;
  std::function<grpc::Status(const v1::AttachJobRequest&,
                             grpc::ServerWriter<v1::AttachJobResponse>&)>
      on_attach_job;

 private:
  grpc::Status AttachJob(grpc::ServerContext*, const v1::AttachJobRequest* request,
                         grpc::ServerWriter<v1::AttachJobResponse>* stream) override {
    return on_attach_job(*request, *stream);
  }
  grpc::Status Smooth(grpc::ServerContext* context, ServerStream* stream) override {
    return on_smooth(*context, *stream);
  }
  grpc::Status ListJobs(grpc::ServerContext*, const v1::ListJobsRequest* request,
                        v1::ListJobsResponse* response) override {
    *response = on_list_jobs(*request);
    return grpc::Status::OK;
  }
};

/// A server of that service on a free port of the loopback device.
class MockServer {
 public:
  MockServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&service);
    server_ = builder.BuildAndStart();
    // There is one where a real server has been in this process.
    if (auto* const health = server_->GetHealthCheckService()) {
      health->SetServingStatus(v1::SmoothingService::service_full_name(), true);
    }
  }
  ~MockServer() { die(); }

  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  /// Ends all calls and connections at once.
  void die() { server_->Shutdown(std::chrono::system_clock::now()); }

  MockService service;

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

inline grpc::Status refusal(grpc::StatusCode code, const std::string& reason,
                            const std::string& message, ErrorDetails metadata = {},
                            std::optional<std::chrono::nanoseconds> retry_delay = {}) {
  return {code, message,
          wire::encode_status_details({.code = code,
                                       .message = message,
                                       .reason = reason,
                                       .metadata = std::move(metadata),
                                       .retry_delay = retry_delay})};
}

inline v1::JobSpec read_spec(ServerStream& stream) {
  v1::SmoothRequest request;
  stream.Read(&request);
  return request.spec();
}

inline void accept(ServerStream& stream) {
  v1::SmoothResponse response;
  response.mutable_accepted()->mutable_job()->set_name("jobs/mock");
  stream.Write(response);
}

inline void stop_sending(ServerStream& stream) {
  v1::SmoothResponse response;
  response.mutable_stop_sending();
  stream.Write(response);
}

inline void progress(ServerStream& stream, int iteration) {
  v1::SmoothResponse response;
  response.mutable_progress()->set_state(v1::STATE_RUNNING);
  response.mutable_progress()->set_stage(v1::STAGE_ITERATE);
  response.mutable_progress()->set_iteration(iteration);
  stream.Write(response);
}

/// All data until the half-close; the arrays one after the other.
struct Upload {
  std::string elements;
  std::string fixed_mask;
  std::string element_regions;
  std::string coordinates;
  std::size_t chunk_count = 0;

  [[nodiscard]] std::size_t size_bytes() const {
    return elements.size() + fixed_mask.size() + element_regions.size() + coordinates.size();
  }
};

inline Upload read_upload(ServerStream& stream) {
  Upload upload;
  for (v1::SmoothRequest request; stream.Read(&request);) {
    const v1::Chunk& chunk = request.chunk();
    ++upload.chunk_count;
    if (chunk.array_id() == v1::ARRAY_ID_ELEMENTS) upload.elements += chunk.data();
    if (chunk.array_id() == v1::ARRAY_ID_FIXED_MASK) upload.fixed_mask += chunk.data();
    if (chunk.array_id() == v1::ARRAY_ID_ELEMENT_REGIONS) upload.element_regions += chunk.data();
    if (chunk.array_id() == v1::ARRAY_ID_COORDINATES) upload.coordinates += chunk.data();
  }
  return upload;
}

inline void send_header(ServerStream& stream, std::int64_t node_count, v1::ScalarType type,
                        std::int64_t size_bytes) {
  v1::SmoothResponse response;
  response.mutable_result()->set_node_count(node_count);
  response.mutable_result()->set_coordinate_type(type);
  response.mutable_result()->set_size_bytes(size_bytes);
  stream.Write(response);
}

inline void send_chunk(ServerStream& stream, std::int64_t offset, const std::string& data) {
  v1::SmoothResponse response;
  response.mutable_chunk()->set_array_id(v1::ARRAY_ID_COORDINATES);
  response.mutable_chunk()->set_offset_bytes(offset);
  response.mutable_chunk()->set_data(data);
  stream.Write(response);
}

inline void send_summary(ServerStream& stream) {
  v1::SmoothResponse response;
  response.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
  response.mutable_summary()->mutable_convergence()->set_iteration_count(7);
  stream.Write(response);
}

}  // namespace meshsmooth::testing
