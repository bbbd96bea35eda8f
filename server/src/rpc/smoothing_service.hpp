#pragma once

#include "engine.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"

namespace meshsmooth::server {

/// The calls of meshsmooth.v1; has no state of its own. Calls that are not
/// overridden answer UNIMPLEMENTED.
class SmoothingService final : public v1::SmoothingService::CallbackService {
 public:
  /// `engine` must outlive it.
  explicit SmoothingService(Engine& engine) : engine_(engine) {}

  grpc::ServerBidiReactor<v1::SmoothRequest, v1::SmoothResponse>* Smooth(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* GetTopology(grpc::CallbackServerContext* context,
                                        const v1::GetTopologyRequest* request,
                                        v1::GetTopologyResponse* response) override;
  grpc::ServerUnaryReactor* DeleteTopology(grpc::CallbackServerContext* context,
                                           const v1::DeleteTopologyRequest* request,
                                           v1::DeleteTopologyResponse* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const v1::GetJobRequest* request,
                                   v1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1::CancelJobRequest* request,
                                      v1::CancelJobResponse* response) override;
  grpc::ServerWriteReactor<v1::AttachJobResponse>* AttachJob(
      grpc::CallbackServerContext* context, const v1::AttachJobRequest* request) override;
  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const v1::DeleteJobRequest* request,
                                      v1::DeleteJobResponse* response) override;
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  Engine& engine_;
};

}  // namespace meshsmooth::server
