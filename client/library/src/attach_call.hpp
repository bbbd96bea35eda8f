#pragma once

#include <optional>
#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "result_assembler.hpp"

namespace meshsmooth::client {

/// Receives the result of a job by AttachJob calls, each from where the one before ended.
class AttachCall {
 public:
  /// `request` is `completed`.
  AttachCall(v1::SmoothingService::StubInterface& stub, std::string server, std::string job_name,
             Mesh& mesh, const RequestOptions& request);

  /// Needs to be called once. Throws `ServiceError`, and what on_progress throws.
  SmoothReport run();

 private:
  void attempt(std::chrono::nanoseconds timeout);
  void handle(const v1::AttachJobResponse& response);

  v1::SmoothingService::StubInterface& stub_;
  const std::string server_;
  const std::string job_name_;
  Mesh& mesh_;
  const RequestOptions& request_;
  ResultAssembler result_;
  std::optional<v1::Summary> summary_;
};

}  // namespace meshsmooth::client
