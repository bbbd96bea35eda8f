#pragma once

#include <grpcpp/channel.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "buffer_cache.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/input_use.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "region/region_pool.hpp"
#include "retry.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"

namespace meshsmooth::client {

/// Timeout of calls that carry no mesh.
inline constexpr std::chrono::seconds kShortTimeout{30};

/// Where the positions of a job are put that its caller gets.
struct Delivery {
  Positions memory = {};             // before the job, room for them or nothing
  RegionPool::Borrowed region = {};  // they lie in it if `in_region` says so
  std::span<std::byte> in_region = {};
  std::size_t more_bytes = 0;  // that a new region has beyond what the job needs

  /// Copies them from the region to memory, in the precision of `like`.
  void copy_to_memory(const PositionsView& like) {
    make_room(memory, like);
    std::visit(
        [&]<class Real>(std::vector<Vec3<Real>>& positions) {
          const auto* first = reinterpret_cast<const Vec3<Real>*>(in_region.data());
          positions.assign(first, first + in_region.size() / sizeof(*first));
        },
        memory);
    in_region = {};
  }
};

struct Client::Impl {
  Impl(std::shared_ptr<grpc::Channel> its_channel, std::string its_name)
      : channel(std::move(its_channel)),
        stub(v1::SmoothingService::NewStub(channel)),
        name(std::move(its_name)) {
    if (name.starts_with("unix:")) regions.emplace(*stub);
  }

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
    Delivery delivery{.memory = std::move(buffer.positions)};
    SmoothReport report = smooth(job, options, request, {}, delivery);
    if (!delivery.in_region.empty()) delivery.copy_to_memory(job.positions);
    delivery.region.keep();
    buffer.positions = std::exchange(mesh.positions, std::move(delivery.memory));
    return report;
  }

  /// A job, in as many attempts as the request allows, the first one in a region where there is
  /// one. With the region of `delivery`, its positions there are kept until it succeeds.
  SmoothReport smooth(const JobMesh& job, const SmoothOptions& given, const RequestOptions& request,
                      TopologyUse topology, Delivery& delivery) {
    validate_input_use(given, job.input);
    const SmoothOptions options = with_target_of(given, job.input);
    const RequestOptions complete = completed(request, job.mesh, options);
    Retry retry(complete);
    std::size_t early_bytes = last_was_accepted ? kManyEarlyBytes : kFewEarlyBytes;
    bool in_region = complete.shared_memory && regions;
    for (;;) {
      SmoothCall call({channel, name}, job, options, complete,
                      {retry.left(), early_bytes, topology}, delivery.memory);
      RegionPool::Borrowed borrowed;
      const bool used = in_region && use_region(call, delivery, borrowed);
      try {
        SmoothReport report = call.run();
        last_was_accepted = true;
        if (borrowed.get() != nullptr) delivery.region = std::move(borrowed);
        delivery.in_region = call.positions_in_region();
        return report;
      } catch (const ServiceError& error) {
        last_was_accepted = false;
        if (used) {
          in_region = false;  // retry with chunks, whatever failed
          if (is_about_region(error)) continue;
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

  /// @returns whether the call has a region: none where its data go at once, or while there is
  /// none.
  bool use_region(SmoothCall& call, const Delivery& delivery, RegionPool::Borrowed& borrowed) {
    const std::size_t bytes = call.region_bytes();
    if (bytes < kFewEarlyBytes) return false;
    if (delivery.region.get() != nullptr)
      return call.use(*delivery.region.get(), delivery.in_region);
    borrowed = regions->borrow(bytes + delivery.more_bytes);
    return borrowed.get() != nullptr && call.use(*borrowed.get());
  }

  /// Whether the server refused the region, not the job.
  [[nodiscard]] static bool is_about_region(const ServiceError& error) {
    if (error.reason().starts_with("REGION_")) return true;
    return std::ranges::any_of(error.details(), [](const auto& detail) {
      return detail.first == "field" && detail.second.starts_with("region");
    });
  }

  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SmoothingService::Stub> stub;
  std::string name;
  /// Whether the last job succeeded: a server is behind the channel, and takes jobs.
  std::atomic<bool> last_was_accepted = false;
  BufferCache buffers;
  std::optional<RegionPool> regions;  // where the server is on this host
};

}  // namespace meshsmooth::client
