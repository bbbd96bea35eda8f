#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "meshsmooth/server.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "support/fake_smoother.hpp"

namespace meshsmooth::testing {

/// A quiet server with fake smoothers, on no port, that leaves at once.
inline server::ServerConfig quiet_config() {
  server::ServerConfig config;
  config.listen = "";
  config.log_level = "off";
  config.host_memory_limit_bytes = 1 << 30;
  config.lanes = 1;  // on any machine
  config.reserved_lanes = 0;
  config.interactive_callers = "all";
  // Tests speak both sides of a call, so a client reads only after it has sent; and the
  // machine may be busy.
  config.drop_timeout = std::chrono::seconds(10);
  config.lame_duck = std::chrono::seconds(0);
  config.drain_grace = std::chrono::seconds(0);
  return config;
}

/// A started server; `fake` steers its lanes.
class InProcessServer {
 public:
  explicit InProcessServer(server::ServerConfig config = quiet_config(), DeviceSpace space = {})
      : server_(std::move(config),
                [fake = fake_] { return std::make_unique<FakeSmoother>(fake); }) {
    fake_->set_device_space(space);
    server_.start();
  }
  /// Whatever a test did: once its calls are over, no job lives, no lane is busy and
  /// every promise of memory has come back.
  ~InProcessServer() {
    fake_->release();
    expect_conserved();
  }

  /// Waits for all jobs and calls by itself; afterwards the server answers nobody.
  void drain() {
    drained_ = true;
    server_.drain();
  }

  /// For tests that leave results or topologies behind on purpose.
  void keeps_something() { keeps_something_ = true; }

  [[nodiscard]] server::Server& server() { return server_; }
  [[nodiscard]] FakeControl& fake() { return *fake_; }
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel() { return server_.in_process_channel(); }

 private:
  void expect_conserved() {
    if (drained_) return;
    v1::SmoothingService::Stub stub(server_.in_process_channel());
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    for (;;) {
      grpc::ClientContext info_context, jobs_context;
      v1::GetServerInfoResponse info;
      const grpc::Status status = stub.GetServerInfo(&info_context, {}, &info);
      // Where callers need a token, tests look for themselves.
      if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED) return;
      EXPECT_TRUE(status.ok());
      v1::ListJobsRequest request;
      for (const v1::State state :
           {v1::STATE_RECEIVING, v1::STATE_QUEUED, v1::STATE_RUNNING, v1::STATE_SENDING}) {
        request.add_states(state);
      }
      v1::ListJobsResponse jobs;
      EXPECT_TRUE(stub.ListJobs(&jobs_context, request, &jobs).ok());
      if (info.backends_size() == 0) return;
      const v1::Backend& backend = info.backends(0);
      const std::int64_t reserved = keeps_something_ ? 0 : backend.reserved_bytes();
      if (jobs.jobs_size() == 0 && backend.busy_lane_count() == 0 && reserved == 0) return;
      if (std::chrono::steady_clock::now() > limit) {
        ADD_FAILURE() << jobs.jobs_size() << " jobs live, " << backend.busy_lane_count()
                      << " lanes are busy, " << reserved << " bytes are reserved";
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  bool keeps_something_ = false;
  std::atomic<bool> drained_ = false;
  const std::shared_ptr<FakeControl> fake_ = std::make_shared<FakeControl>();
  server::Server server_;
};

}  // namespace meshsmooth::testing
