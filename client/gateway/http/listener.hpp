#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "http/connection.hpp"

namespace meshsmooth::gateway {

/// Accepts connections and serves each by a thread of its own. When there are too many, one gives
/// way for each that comes: without a request, answered, of events, or of a slow transfer.
class Listener {
 public:
  struct Options {
    std::string host;
    int port = 0;
    std::string tls_cert, tls_key;  // empty: in clear
    std::size_t max_connections = 0;
  };

  /// Throws `std::runtime_error`.
  explicit Listener(const Options& options);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// Until `stop`, and then until all requests have ended.
  void run(const std::function<void(Connection&)>& serve);
  /// From now on nobody is accepted, and connections without a request end. By any thread.
  void stop();
  /// Ends everything that is no work, too. By any thread.
  void end_transfers();

 private:
  struct Entry {
    std::unique_ptr<Connection> connection;
    std::thread thread;
    bool has_ended = false;
  };

  void add(TimedSocket::Socket socket, const std::function<void(Connection&)>& serve);
  void make_room();
  void join_ended();

  boost::asio::io_context context_;
  boost::asio::ip::tcp::acceptor acceptor_;
  std::optional<Connection::TlsContext> tls_;
  const std::size_t max_connections_;
  int port_ = -1;
  int wake_ = -1;  // an eventfd
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Entry> entries_;
};

}  // namespace meshsmooth::gateway
