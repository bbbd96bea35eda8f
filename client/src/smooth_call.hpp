#pragma once

#include <grpcpp/client_context.h>

#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <thread>

#include "meshsmooth/client.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "result_assembler.hpp"

namespace meshsmooth::client {

[[nodiscard]] JobProgress decode_progress(const v1::Progress& message);

/// Throws `ServiceError` when the summary cannot be understood.
[[nodiscard]] SmoothReport decode_report(const v1::Summary& summary, const std::string& job_name,
                                         const std::string& request_id);

/// See RequestOptions::timeout.
[[nodiscard]] std::chrono::nanoseconds default_timeout(const Mesh& mesh,
                                                       const SmoothOptions& options);

/// How a call tells the server its mesh's topology.
struct TopologyUse {
  std::string name;   // not empty: by this name alone
  bool kept = false;  // inline, and kept under its name
  // For proxies, as metadata: calls of one topology belong to one server. Empty: to any.
  std::string route;
};

/// The metadata's key.
inline constexpr const char* kRouteKey = "meshsmooth-topology";

/// One Smooth call from spec to status. Two threads: the caller's reads, its
/// own uploads once the server has accepted, so that progress, StopSending and
/// early failures are seen while data is still going out.
class SmoothCall {
 public:
  SmoothCall(v1::SmoothingService::StubInterface& stub, std::string server, Mesh& mesh,
             const SmoothOptions& options, const RequestOptions& request,
             TopologyUse topology = {});

  /// Needs to be called once. Throws `ServiceError`, and what on_progress throws.
  SmoothReport run();

 private:
  using Stream = grpc::ClientReaderWriterInterface<v1::SmoothRequest, v1::SmoothResponse>;

  [[nodiscard]] v1::JobSpec make_spec() const;
  void converse();
  void handle(const v1::SmoothResponse& response);
  void accept(const v1::Accepted& accepted);
  void stop_sending();
  void upload();
  bool upload_array(v1::ArrayId id, std::span<const std::span<const std::byte>> parts);

  v1::SmoothingService::StubInterface& stub_;
  std::string server_;
  Mesh& mesh_;
  const SmoothOptions& options_;
  const RequestOptions& request_;
  const TopologyUse topology_;
  std::string request_id_;
  std::chrono::nanoseconds timeout_;

  grpc::ClientContext context_;
  std::unique_ptr<Stream> stream_;
  std::jthread uploader_;
  std::atomic<bool> sending_stopped_{false};
  std::string job_name_;
  ResultAssembler result_;
  std::optional<v1::Summary> summary_;
};

}  // namespace meshsmooth::client
