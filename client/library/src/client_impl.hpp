#pragma once

#include <grpcpp/channel.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "buffer_cache.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/input_use.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "retry.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"
#include "transport/transfer.hpp"

namespace meshsmooth::client {

/// Timeout of calls that carry no mesh.
inline constexpr std::chrono::seconds kShortTimeout{30};

/// How the positions of a job get to its caller.
struct Delivery {
  Positions memory = {};  // before the job, room for them or nothing
  /// Before the job, one that the session has; after it, that of the result.
  std::unique_ptr<Transfer> transfer = {};
  bool in_place = false;       // whether they lie in the transfer's
  std::size_t more_bytes = 0;  // that a new transfer has beyond what the job needs
};

/// The same positions in memory, in the precision of `like`. `memory` is filled instead of new
/// where it is large enough.
[[nodiscard]] inline Positions copied(std::span<const std::byte> bytes, const PositionsView& like,
                                      Positions memory) {
  make_room(memory, like);
  std::visit(
      [&]<class Real>(std::vector<Vec3<Real>>& positions) {
        const auto* first = reinterpret_cast<const Vec3<Real>*>(bytes.data());
        positions.assign(first, first + bytes.size() / sizeof(*first));
      },
      memory);
  return memory;
}

struct Client::Impl {
  Impl(std::shared_ptr<grpc::Channel> its_channel, std::string its_name)
      : channel(std::move(its_channel)),
        stub(v1::SmoothingService::NewStub(channel)),
        name(std::move(its_name)),
        transport(make_transport(name, *stub)) {}

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

  /// Smooths a mesh in place.
  SmoothReport smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request,
                      const JobInput& input) {
    const JobMesh job{mesh, mesh.positions_view(), input};
    BorrowedBuffer buffer(buffers, job.positions);
    Positions memory = std::move(buffer.positions);
    SmoothReport report = smooth(job, options, request, {}, memory);
    buffer.positions = std::exchange(mesh.positions, std::move(memory));
    return report;
  }

  /// A job whose positions end in `memory`, which may have room for them.
  SmoothReport smooth(const JobMesh& job, const SmoothOptions& options,
                      const RequestOptions& request, TopologyUse topology, Positions& memory) {
    Delivery delivery{.memory = std::move(memory)};
    SmoothReport report = smooth(job, options, request, std::move(topology), delivery);
    if (delivery.in_place) {
      delivery.memory =
          copied(delivery.transfer->positions(), job.positions, std::move(delivery.memory));
    }
    if (delivery.transfer) delivery.transfer->keep();
    memory = std::move(delivery.memory);
    return report;
  }

  /// A job, in as many attempts as the request allows, only the first one by a transfer, where
  /// there is one. The positions of that of `delivery` are kept until the job succeeds.
  SmoothReport smooth(const JobMesh& job, const SmoothOptions& given, const RequestOptions& request,
                      TopologyUse topology, Delivery& delivery) {
    validate_input_use(given, job.input);
    const SmoothOptions options = with_target_of(given, job.input);
    const RequestOptions complete = completed(request, job.mesh, options);
    Retry retry(complete);
    std::size_t early_bytes = last_was_accepted ? kManyEarlyBytes : kFewEarlyBytes;
    bool may_transfer = complete.shared_memory && transport != nullptr;
    for (;;) {
      SmoothCall call({channel, name}, job, options, complete,
                      {retry.left(), early_bytes, topology}, delivery.memory);
      std::unique_ptr<Transfer> opened;
      Transfer* const transfer = may_transfer ? find_transfer(call, delivery, opened) : nullptr;
      try {
        SmoothReport report = call.run();
        last_was_accepted = true;
        report.shared_memory = transfer != nullptr;
        delivery.in_place = call.in_place();
        if (delivery.in_place) transfer->hold_positions(bytes_of(job.positions).size());
        if (opened) delivery.transfer = std::move(opened);
        return report;
      } catch (const ServiceError& error) {
        last_was_accepted = false;
        if (transfer != nullptr) {
          may_transfer = false;  // retry with chunks, whatever failed
          if (transport->refused(error)) continue;
        }
        // Sent along with the same job, not as another one.
        if (error.reason() == "TOPOLOGY_NOT_FOUND" && !topology.name.empty()) {
          topology.name.clear();
          topology.kept = true;
          continue;
        }
        // The server itself rejected it: a proxy may choose another.
        if (!error.reason().empty()) topology.route.clear();
        // Cut off with much data in flight, which may hide a proxy's answer: try with less. Not at
        // the deadline, which gRPC may find a moment before it is here.
        const bool unheard = std::exchange(early_bytes, kFewEarlyBytes) == kManyEarlyBytes &&
                             !call.answered() && error.code() != StatusCode::deadline_exceeded;
        if (!unheard || !error.reason().empty() || retry.left().count() <= 0) retry.wait(error);
      }
    }
  }

  /// That of the delivery, or one that is opened. Null where the data of the call go at once in
  /// chunks, or while there is none.
  Transfer* find_transfer(SmoothCall& call, const Delivery& delivery,
                          std::unique_ptr<Transfer>& opened) const {
    const std::size_t bytes = call.transfer_bytes();
    if (bytes < kFewEarlyBytes) return nullptr;
    Transfer* transfer = delivery.transfer.get();
    if (transfer == nullptr) {
      opened = transport->open(bytes + delivery.more_bytes);
      transfer = opened.get();
    }
    return transfer != nullptr && call.use(*transfer) ? transfer : nullptr;
  }

  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SmoothingService::Stub> stub;
  std::string name;
  /// Whether the last job succeeded: a server is behind the channel, and takes jobs.
  std::atomic<bool> last_was_accepted = false;
  BufferCache buffers;
  std::unique_ptr<Transport> transport;  // null: all arrays travel in chunks
};

}  // namespace meshsmooth::client
