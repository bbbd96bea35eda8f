#pragma once

#include <functional>
#include <map>
#include <string>

struct mg_context;
struct mg_connection;

namespace meshsmooth::server {

struct HttpAnswer {
  int status = 200;
  std::string text;
};

/// Serves a few fixed pages in plain HTTP, for probes and Prometheus, from threads of its own.
class AdminServer {
 public:
  using Pages = std::map<std::string, std::function<HttpAnswer()>, std::less<>>;

  /// Serves `pages` by path on `address` (HOST:PORT; port 0 picks one). Throws
  /// InvalidOption (OPTION_OUT_OF_RANGE) when it cannot be bound.
  AdminServer(const std::string& address, Pages pages);
  /// Waits for the answers in progress.
  ~AdminServer();
  AdminServer(const AdminServer&) = delete;
  AdminServer& operator=(const AdminServer&) = delete;

  [[nodiscard]] int port() const;

 private:
  static int handle(mg_connection* connection, void* self);
  [[nodiscard]] HttpAnswer answer(const std::string& method, const std::string& path) const;

  const Pages pages_;
  mg_context* context_ = nullptr;
};

}  // namespace meshsmooth::server
