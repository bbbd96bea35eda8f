#pragma once

#include <grpcpp/channel.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "buffer_cache.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "region/region_pool.hpp"
#include "retry.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"

namespace meshsmooth::client {

/// Timeout of calls that carry no mesh.
inline constexpr std::chrono::seconds kShortTimeout{30};

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

  /// A job, in as many attempts as the request allows.
  SmoothReport smooth(Mesh& mesh, const SmoothOptions& options, const RequestOptions& request,
                      TopologyUse topology) {
    const RequestOptions complete = completed(request, mesh, options);
    Retry retry(complete);
    std::size_t early_bytes = last_was_accepted ? kManyEarlyBytes : kFewEarlyBytes;
    BorrowedBuffer buffer(buffers, mesh);
    bool in_region = complete.shared_memory && regions;
    for (;;) {
      SmoothCall call({channel, name}, mesh, options, complete,
                      {retry.left(), early_bytes, topology}, buffer.positions);
      RegionPool::Borrowed region;
      if (in_region) region = borrow_region(call);
      try {
        SmoothReport report = call.run();
        region.keep();
        last_was_accepted = true;
        return report;
      } catch (const ServiceError& error) {
        last_was_accepted = false;
        if (region.get() != nullptr) {
          region.give_up();
          in_region = false;  // whatever it was, chunks may do
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
        // Cut off with much data in flight, which may hide a proxy's answer: try with less.
        const bool unheard =
            std::exchange(early_bytes, kFewEarlyBytes) == kManyEarlyBytes && !call.answered();
        if (!unheard || !error.reason().empty() || retry.left().count() <= 0) retry.wait(error);
      }
    }
  }

  /// Nothing for a job whose data go at once, or while there is no region.
  [[nodiscard]] RegionPool::Borrowed borrow_region(SmoothCall& call) {
    const std::size_t bytes = call.region_bytes();
    if (bytes < kFewEarlyBytes) return {};
    RegionPool::Borrowed region = regions->borrow(bytes);
    if (region.get() != nullptr) call.use(*region.get());
    return region;
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
