#pragma once

#include "engine.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "rpc/authenticator.hpp"

namespace meshsmooth::server {

/// v1::SmoothingService::CallbackService, but Smooth and AttachJob exchange raw messages.
using SmoothingServiceBase = v1::SmoothingService::WithRawCallbackMethod_Smooth<
    v1::SmoothingService::WithCallbackMethod_GetTopology<
        v1::SmoothingService::WithCallbackMethod_DeleteTopology<
            v1::SmoothingService::WithCallbackMethod_GetJob<
                v1::SmoothingService::WithCallbackMethod_ListJobs<
                    v1::SmoothingService::WithCallbackMethod_CancelJob<
                        v1::SmoothingService::WithRawCallbackMethod_AttachJob<
                            v1::SmoothingService::WithCallbackMethod_DeleteJob<
                                v1::SmoothingService::WithCallbackMethod_GetServerInfo<
                                    v1::SmoothingService::Service>>>>>>>>>;

/// The calls of meshsmooth.v1; stateless. Calls that are not overridden return
/// UNIMPLEMENTED.
class SmoothingService final : public SmoothingServiceBase {
 public:
  /// `engine` and `authenticator` must outlive it.
  SmoothingService(Engine& engine, const Authenticator& authenticator)
      : engine_(engine), authenticator_(authenticator) {}

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Smooth(
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
  grpc::ServerWriteReactor<grpc::ByteBuffer>* AttachJob(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const v1::DeleteJobRequest* request,
                                      v1::DeleteJobResponse* response) override;
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;

 private:
  /// Answers a unary call at once by `body(caller)`, or by what it throws.
  template <class Body>
  grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context, const Body& body);
  [[nodiscard]] std::shared_ptr<Job> find_job(const Caller& caller, const std::string& name) const;

  Engine& engine_;
  const Authenticator& authenticator_;
};

}  // namespace meshsmooth::server
