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
#include "region/leased_region.hpp"
#include "report.hpp"
#include "result_assembler.hpp"

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

  /// What the arrays of the job and of its result take in a region.
  [[nodiscard]] std::size_t region_bytes() const;
  /// Copies the arrays to a region, unless they lie there, for them to travel in it; before `run`.
  /// @param kept  bytes of the region that are not written to, or empty.
  /// @returns whether there was room.
  bool use(LeasedRegion& region, std::span<const std::byte> kept = {});

  /// Needs to be called once. Throws `ServiceError`, and what on_progress throws. The positions of
  /// the result lie in `memory`, or in the region.
  SmoothReport run();
  /// After `run`: the positions, where they lie in the region.
  [[nodiscard]] std::span<std::byte> positions_in_region() const { return in_region_; }
  /// Whether the server has accepted the job, or refused it itself.
  [[nodiscard]] bool answered() const { return accepted_ || sending_stopped_; }

 private:
  /// An array of the mesh, or the part of it that is still to be sent.
  struct Part {
    v1::ArrayId id;
    std::int64_t offset_bytes;
    std::span<const std::byte> rest;
  };

  [[nodiscard]] v1::JobSpec make_spec() const;
  [[nodiscard]] std::vector<Part> parts_to_send() const;
  [[nodiscard]] std::size_t result_bytes() const;
  grpc::Status converse(const v1::SmoothRequest& first);
  void handle(grpc::ByteBuffer& response);
  void handle(const v1::SmoothResponse& response);
  void accept(const v1::Accepted& accepted);
  void begin_result(const v1::ResultHeader& header);
  void find_result_in_region();
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
  std::vector<Part> to_send_;  // the next one last
  std::size_t early_bytes_;    // that may still be sent before the server has answered
  LeasedRegion* region_ = nullptr;
  v1::RegionUse region_use_;
  bool announced_in_region_ = false;
  std::span<std::byte> in_region_;
  std::string job_name_;
  ResultAssembler result_;
  Positions& memory_;
  std::optional<v1::Summary> summary_;
};

}  // namespace meshsmooth::client
