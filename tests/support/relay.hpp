#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <list>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace meshsmooth::testing {

/// Carries TCP connections to a server on loopback: as they are, slowly, or until they are cut
/// or reset.
class Relay {
 public:
  explicit Relay(int server_port) : server_port_(server_port), listener_(make_socket()) {
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        listen(listener_, 64) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen on loopback");
    }
    port_ = ntohs(address.sin_port);
    acceptor_ = std::thread([this] { accept_all(); });
  }
  ~Relay() {
    cut();
    acceptor_.join();
    for (Connection& connection : connections_) {
      for (std::thread& thread : connection.copiers) thread.join();
      for (const int socket : {connection.client, connection.server}) close(socket);
    }
    close(listener_);
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }

  /// What clients and server have sent, of all connections.
  [[nodiscard]] std::int64_t bytes_up() const { return bytes_up_; }
  [[nodiscard]] std::int64_t bytes_down() const { return bytes_down_; }

  /// From now on no more bytes a second than that, each way and connection; 0: as fast as it goes.
  void slow_down(std::int64_t rate) { up_rate_ = down_rate_ = rate; }
  /// Only what clients send, or only what they get.
  void slow_down_up(std::int64_t rate) { up_rate_ = rate; }
  void slow_down_down(std::int64_t rate) { down_rate_ = rate; }

  /// Ends all connections for ever: to each side the other is gone without a word.
  void cut() {
    cut_ = true;
    shutdown(listener_, SHUT_RDWR);
    end_connections(false);
  }
  /// Resets those that are there, as a firewall does; new ones are carried.
  void reset() { end_connections(true); }

 private:
  struct Connection {
    int client, server;
    std::vector<std::thread> copiers = {};
  };

  static int make_socket() { return socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0); }
  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

  void accept_all() {
    for (int client; (client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
      const int server = make_socket();
      const sockaddr_in address = loopback(server_port_);
      const bool connected =
          connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
      const std::lock_guard lock(mutex_);
      if (!connected || cut_) {
        close(client);
        close(server);
        continue;
      }
      Connection& connection = connections_.emplace_back(Connection{client, server});
      connection.copiers.emplace_back([=, this] { copy(client, server, bytes_up_, up_rate_); });
      connection.copiers.emplace_back([=, this] { copy(server, client, bytes_down_, down_rate_); });
    }
  }

  void copy(int from, int to, std::atomic<std::int64_t>& bytes,
            const std::atomic<std::int64_t>& allowed_rate) {
    std::vector<char> buffer(1 << 16);
    for (;;) {
      const std::int64_t rate = allowed_rate;
      const std::size_t most = rate == 0 ? buffer.size() : static_cast<std::size_t>(rate / 50 + 1);
      const ssize_t count = recv(from, buffer.data(), std::min(most, buffer.size()), 0);
      if (count <= 0) break;
      bytes += count;
      for (ssize_t sent = 0; sent < count;) {
        const ssize_t written =
            send(to, buffer.data() + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
        if (written <= 0) return;
        sent += written;
      }
      if (rate != 0) pause(static_cast<double>(count) / static_cast<double>(rate), allowed_rate);
    }
    shutdown(to, SHUT_WR);
  }

  // In short steps, so that nobody waits for its end.
  void pause(double seconds, const std::atomic<std::int64_t>& rate) const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!cut_ && rate != 0 && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  void end_connections(bool by_reset) {
    const std::lock_guard lock(mutex_);
    for (const Connection& connection : connections_) {
      for (const int socket : {connection.client, connection.server}) {
        if (by_reset) {
          // To connect to nothing is how a socket is reset under those who use it.
          const linger at_once{1, 0};
          setsockopt(socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
          sockaddr nothing{};
          nothing.sa_family = AF_UNSPEC;
          connect(socket, &nothing, sizeof nothing);
        }
        shutdown(socket, SHUT_RDWR);
      }
    }
  }

  const int server_port_;
  const int listener_;
  int port_ = 0;
  std::atomic<bool> cut_ = false;
  std::atomic<std::int64_t> up_rate_ = 0, down_rate_ = 0;
  std::atomic<std::int64_t> bytes_up_ = 0, bytes_down_ = 0;
  std::mutex mutex_;
  std::list<Connection> connections_;
  std::thread acceptor_;
};

}  // namespace meshsmooth::testing
