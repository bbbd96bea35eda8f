#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "meshsmooth/client.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "report.hpp"
#include "result_assembler.hpp"
#include "transport/transfer.hpp"

namespace meshsmooth::client {

/// The request with its request id and timeout filled in where they are unset.
[[nodiscard]] RequestOptions completed(RequestOptions request, const Mesh& mesh,
                                       const SmoothOptions& options);

/// The server of a call.
struct CallTarget {
  std::shared_ptr<grpc::Channel> channel;
  std::string server;  // as the user named it
};

/// How a call names or sends its mesh's topology.
struct TopologyUse {
  std::string name;   // not empty: by this name alone
  bool kept = false;  // inline, and kept under its name
  // For proxies, as metadata: calls of one topology belong to one server. Empty: to any.
  std::string route;
};

/// The metadata's key.
inline constexpr const char* kRouteKey = "meshsmooth-topology";

/// What is sent before it is known whether the server accepts the job: of a large mesh little is in
/// vain, and a proxy can be heard that refuses at once, which it cannot be while more is under way.
inline constexpr std::size_t kFewEarlyBytes = 64 << 10;
/// The same where the last job was accepted: a mesh of this size does not wait for the answer.
inline constexpr std::size_t kManyEarlyBytes = 2 << 20;

/// The mesh of a job: the elements of one, and positions in place of its own. What else it is
/// given.
struct JobMesh {
  const Mesh& mesh;
  PositionsView positions;
  JobInput input = {};
};

/// What differs between the attempts at one job.
struct Attempt {
  std::chrono::nanoseconds left;  // of the request's timeout
  std::size_t early_bytes = kFewEarlyBytes;
  TopologyUse topology = {};
};

/// One Smooth call from spec to status. All on the caller's thread: one read and one write are
/// under way at a time, so that progress, StopSending and early failures are seen while data is
/// still going out.
class SmoothCall {
 public:
  /// `request` is `completed`. `memory` is for the positions of the result.
  SmoothCall(const CallTarget& target, const JobMesh& job, const SmoothOptions& options,
             const RequestOptions& request, Attempt attempt, Positions& memory);

  /// What the arrays of the job and of its result take in a transfer.
  [[nodiscard]] std::size_t transfer_bytes() const;
  /// Has the arrays travel that way instead of in chunks; before `run`.
  /// @returns whether there was room.
  bool use(Transfer& transfer);

  /// Needs to be called once. Throws `ServiceError`, and what on_progress throws.
  SmoothReport run();
  /// After `run`: whether the positions of the result lie in the transfer's. Else they lie in
  /// `memory`.
  [[nodiscard]] bool in_place() const { return in_place_; }
  /// Whether the server has accepted the job, or refused it itself.
  [[nodiscard]] bool answered() const { return accepted_ || sending_stopped_; }

 private:
  [[nodiscard]] v1::JobSpec make_spec() const;
  [[nodiscard]] std::vector<ArrayPart> parts_to_send() const;
  [[nodiscard]] std::size_t result_bytes() const;
  grpc::Status converse(const v1::SmoothRequest& first);
  void handle(grpc::ByteBuffer& response);
  void handle(const v1::SmoothResponse& response);
  void accept(const v1::Accepted& accepted);
  void begin_result(const v1::ResultHeader& header);
  /// Throws `ServiceError` unless the result has the metrics that were asked for: an older server
  /// ignores them.
  void check_metrics() const;
  void stop_sending();
  void write_next();

  const std::string server_;
  const JobMesh job_;
  const Mesh& mesh_;
  const PositionsView positions_;
  const SmoothOptions& options_;
  const RequestOptions& request_;
  const TopologyUse topology_;
  const std::chrono::nanoseconds left_;

  grpc::GenericStub stub_;
  grpc::CompletionQueue events_;
  grpc::ClientContext context_;
  // Of messages as they travel: chunks go around protobuf.
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  bool writing_ = false;
  bool accepted_ = false;
  bool half_closed_ = false;
  bool sending_stopped_ = false;
  // Prescribed positions or the reference, in the mesh's precision where they come in the other.
  const Positions converted_;
  std::vector<ArrayPart> to_send_;  // the next one last
  std::size_t early_bytes_;         // that may still be sent before the server has answered
  Transfer* transfer_ = nullptr;
  v1::JobSpec of_transfer_;  // fields of the spec
  bool in_place_ = false;
  std::string job_name_;
  ResultAssembler result_;
  Positions& memory_;
  std::optional<v1::Summary> summary_;
};

}  // namespace meshsmooth::client
