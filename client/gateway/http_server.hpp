#pragma once

#include <memory>

#include "service.hpp"

namespace meshsmooth::gateway {

/// The paths of the OpenAPI document over HTTP/1.1, each connection with one request: what a
/// refused request leaves unread can never be taken for another.
class HttpServer {
 public:
  /// Binds. Throws `std::runtime_error` with the reason.
  explicit HttpServer(Service& service);
  ~HttpServer();

  [[nodiscard]] int port() const;
  /// Serves until `stop`, and the requests of then to their end.
  void run();
  /// Takes no more connections. By any thread.
  void stop();
  /// Ends uploads and answers, too. By any thread.
  void end_transfers();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::gateway
