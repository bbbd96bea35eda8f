#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <utility>

#include "meshsmooth/server.hpp"
#include "support/fake_smoother.hpp"

namespace meshsmooth::testing {

/// A quiet server with fake smoothers, on no port, that leaves at once.
inline server::ServerConfig quiet_config() {
  server::ServerConfig config;
  config.listen = "";
  config.log_level = "off";
  config.host_memory_limit_bytes = 1 << 30;
  config.lame_duck_seconds = 0;
  config.drain_grace_seconds = 0;
  return config;
}

/// A started server; `fake` steers its lanes.
class InProcessServer {
 public:
  explicit InProcessServer(server::ServerConfig config = quiet_config())
      : server_(std::move(config),
                [fake = fake_] { return std::make_unique<FakeSmoother>(fake); }) {
    server_.start();
  }
  ~InProcessServer() { fake_->release(); }

  [[nodiscard]] server::Server& server() { return server_; }
  [[nodiscard]] FakeControl& fake() { return *fake_; }
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel() { return server_.in_process_channel(); }

 private:
  const std::shared_ptr<FakeControl> fake_ = std::make_shared<FakeControl>();
  server::Server server_;
};

}  // namespace meshsmooth::testing
