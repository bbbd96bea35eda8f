#pragma once

#include <functional>
#include <memory>

#include "meshsmooth/server_config.hpp"
#include "meshsmooth/smoother.hpp"

namespace grpc {
class Channel;
}

namespace meshsmooth::server {

/// Makes the smoother of one lane.
using SmootherFactory = std::function<std::unique_ptr<Smoother>()>;

/// The whole service. Thread-safe.
///
///     Server server({.listen = ""});
///     server.start();
///     client::Client client(server.in_process_channel());
class Server {
 public:
  /// Without a factory the lanes run `make_smoother(config.backend, …)`.
  explicit Server(ServerConfig config, SmootherFactory factory = {});
  /// Drains at once: running jobs are stopped.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Builds the lanes, then serves. `on_device_lost` is called by another thread
  /// when a lane has lost its device: the server no longer says SERVING; drain it
  /// and start another process. Throws NotSupported (BACKEND_NOT_AVAILABLE),
  /// DeviceError, or InvalidOption (OPTION_OUT_OF_RANGE: `listen` cannot be bound,
  /// too many `lanes` for the device). Once.
  void start(std::function<void()> on_device_lost = [] {});

  /// A lane has lost its device.
  [[nodiscard]] bool device_lost() const;

  /// The bound port; 0 when it listens on none.
  [[nodiscard]] int port() const;
  /// The same of `admin_listen`.
  [[nodiscard]] int admin_port() const;

  /// A channel to this server that passes no socket. Needs a started server and
  /// must not be used after it is gone.
  [[nodiscard]] std::shared_ptr<grpc::Channel> in_process_channel();

  /// Leaves in order: health NOT_SERVING, lame duck, refuse new jobs, hand back
  /// the waiting ones, let the running ones finish within the grace, stop them,
  /// shut down. Returns when all is over; a second call waits for the first.
  void drain();

  /// Lets a drain, running or to come, skip lame duck and grace.
  void hurry();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::server
