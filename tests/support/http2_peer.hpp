#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>

// Hand-made HTTP/2, for peers that do what no client does.
namespace meshsmooth::testing {

inline const std::string kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

enum FrameType : char {
  kData = 0,
  kHeaders = 1,
  kReset = 3,
  kSettings = 4,
  kPing = 6,
  kContinuation = 9
};
constexpr char kEndStream = 1, kEndHeaders = 4, kAck = 1;

inline std::string big_endian(std::uint32_t number, int bytes) {
  std::string text;
  for (int b = bytes - 1; b >= 0; --b) text += static_cast<char>(number >> (8 * b));
  return text;
}

inline std::string frame(FrameType type, int flags, std::uint32_t stream,
                         const std::string& payload) {
  return big_endian(static_cast<std::uint32_t>(payload.size()), 3) + static_cast<char>(type) +
         static_cast<char>(flags) + big_endian(stream, 4) + payload;
}

inline std::string header(const std::string& name, const std::string& value) {
  // Literal, never indexed; lengths below 127.
  return std::string("\x10", 1) + static_cast<char>(name.size()) + name +
         static_cast<char>(value.size()) + value;
}

inline std::string call_headers(const std::string& method = "Smooth") {
  return header(":method", "POST") + header(":scheme", "http") +
         header(":path", "/meshsmooth.v1.SmoothingService/" + method) + header(":authority", "x") +
         header("te", "trailers") + header("content-type", "application/grpc");
}

inline std::string begin_call(std::uint32_t stream) {
  return frame(kHeaders, kEndHeaders, stream, call_headers());
}

/// A gRPC message: not compressed, its length, its bytes.
inline std::string message(const std::string& bytes) {
  return std::string(1, '\0') + big_endian(static_cast<std::uint32_t>(bytes.size()), 4) + bytes;
}

/// A connection to a port of loopback.
class Peer {
 public:
  explicit Peer(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~Peer() { close(socket_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  /// False when the server takes no more.
  bool send(const std::string& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// Takes what has come; false when the server has closed the connection.
  bool skip_answers() const {
    char buffer[1 << 16];
    ssize_t count;
    while ((count = recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT)) > 0) {
    }
    return count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
  }
  /// What comes next; empty when the server closes the connection, or after 5 s.
  [[nodiscard]] std::string read_some() const {
    char buffer[4096];
    const ssize_t count = recv(socket_, buffer, sizeof buffer, 0);
    return {buffer, count > 0 ? static_cast<std::size_t>(count) : 0};
  }
  /// Ends its side and takes what the server still says.
  void leave() const {
    shutdown(socket_, SHUT_WR);
    static_cast<void>(is_sent_away());
  }
  /// What comes until the server closes the connection, or for 5 s.
  [[nodiscard]] std::string read_all() const {
    std::string all;
    char buffer[4096];
    ssize_t count;
    while ((count = recv(socket_, buffer, sizeof buffer, 0)) > 0) {
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }
  /// Reads until the server closes the connection; false when it does not within 5 s.
  [[nodiscard]] bool is_sent_away() const {
    char buffer[4096];
    ssize_t count;
    while ((count = recv(socket_, buffer, sizeof buffer, 0)) > 0) {
    }
    return count == 0 || errno == ECONNRESET;
  }

 private:
  int socket_;
  bool connected_;
};

}  // namespace meshsmooth::testing
