#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>

namespace meshsmooth::testing {

/// Carries one TCP connection to a server on loopback until it is cut: to the
/// server the client is then gone without a word.
class Relay {
 public:
  explicit Relay(int server_port) : listener_(make_socket()) {
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        listen(listener_, 1) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen on loopback");
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this, server_port] { run(server_port); });
  }
  ~Relay() {
    cut();
    thread_.join();
    for (const int descriptor : {listener_, client_, server_}) close(descriptor);
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }

  /// What the client has sent.
  [[nodiscard]] std::int64_t bytes_up() const { return bytes_up_; }

  void cut() {
    shutdown(listener_, SHUT_RDWR);
    shutdown(client_, SHUT_RDWR);
    shutdown(server_, SHUT_RDWR);
  }

 private:
  static int make_socket() { return socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0); }
  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

  void run(int server_port) {
    const int accepted = accept(listener_, nullptr, nullptr);
    if (accepted < 0) return;
    dup2(accepted, client_);
    close(accepted);
    const sockaddr_in address = loopback(server_port);
    if (connect(server_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      std::atomic<std::int64_t> bytes_down = 0;
      std::thread back([&] { copy(server_, client_, bytes_down); });
      copy(client_, server_, bytes_up_);
      back.join();
    }
  }

  static void copy(int from, int to, std::atomic<std::int64_t>& bytes) {
    char buffer[1 << 16];
    for (ssize_t count; (count = recv(from, buffer, sizeof buffer, 0)) > 0;) {
      bytes += count;
      for (ssize_t sent = 0; sent < count;) {
        const ssize_t written =
            send(to, buffer + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
        if (written <= 0) return;
        sent += written;
      }
    }
    shutdown(to, SHUT_WR);
  }

  const int listener_;
  // Made at once, so that `cut` may come at any time.
  const int client_ = make_socket();
  const int server_ = make_socket();
  int port_ = 0;
  std::atomic<std::int64_t> bytes_up_ = 0;
  std::thread thread_;
};

}  // namespace meshsmooth::testing
