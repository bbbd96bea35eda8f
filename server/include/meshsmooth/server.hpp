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
  /// Shuts down at once: running jobs are stopped.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Builds the lanes, then serves. `on_device_lost` is called by another thread
  /// when no lane is left, because each lost its device or does not stop its job: the server no
  /// longer reports SERVING; drain it and start another process. Call it once. Throws NotSupported
  /// (BACKEND_NOT_AVAILABLE), DeviceError, or InvalidOption (OPTION_OUT_OF_RANGE: `listen` cannot
  /// be bound, or the device has no memory for so many `lanes`).
  void start(std::function<void()> on_device_lost = [] {});

  /// Whether no lane is left.
  [[nodiscard]] bool device_lost() const;

  /// The bound port; 0 without one.
  [[nodiscard]] int port() const;
  /// The bound port of `admin_listen`; 0 without one.
  [[nodiscard]] int admin_port() const;

  /// A channel to this server without a socket. Needs a started server, and must not be used
  /// after the server is destroyed.
  [[nodiscard]] std::shared_ptr<grpc::Channel> in_process_channel();

  /// Shuts down in order: reports NOT_SERVING, accepts jobs for the lame duck period, then refuses
  /// new jobs, rejects waiting ones as draining, lets running ones finish within the grace period,
  /// stops the rest. Returns when everything has ended; a second call waits for the first.
  void drain();

  /// Makes a drain, current or future, skip the lame duck and grace periods.
  void force_shutdown();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::server
