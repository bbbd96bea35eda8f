// Peers that do not speak the protocol, or speak it to do harm, by hand-made HTTP/2 frames.
#include <arpa/inet.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <random>
#include <string>

#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"
#include "support/sanitizer.hpp"

namespace meshsmooth::testing {
namespace {

const std::string kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

enum FrameType : char { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kContinuation = 9 };
constexpr char kEndStream = 1, kEndHeaders = 4;

std::string big_endian(std::uint32_t number, int bytes) {
  std::string text;
  for (int b = bytes - 1; b >= 0; --b) text += static_cast<char>(number >> (8 * b));
  return text;
}

std::string frame(FrameType type, int flags, std::uint32_t stream, const std::string& payload) {
  return big_endian(static_cast<std::uint32_t>(payload.size()), 3) + static_cast<char>(type) +
         static_cast<char>(flags) + big_endian(stream, 4) + payload;
}

std::string header(const std::string& name, const std::string& value) {
  // Literal, never indexed; lengths below 127.
  return std::string("\x10", 1) + static_cast<char>(name.size()) + name +
         static_cast<char>(value.size()) + value;
}

std::string call_headers() {
  return header(":method", "POST") + header(":scheme", "http") +
         header(":path", "/meshsmooth.v1.SmoothingService/Smooth") + header(":authority", "x") +
         header("te", "trailers") + header("content-type", "application/grpc");
}

std::string begin_call(std::uint32_t stream) {
  return frame(kHeaders, kEndHeaders, stream, call_headers());
}

/// A gRPC message: not compressed, its length, its bytes.
std::string message(const std::string& bytes) {
  return std::string(1, '\0') + big_endian(static_cast<std::uint32_t>(bytes.size()), 4) + bytes;
}

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
  /// Ends its side and takes what the server still says.
  void leave() const {
    shutdown(socket_, SHUT_WR);
    static_cast<void>(is_sent_away());
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

std::int64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

class WireAbuse : public ::testing::Test {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.listen = "127.0.0.1:0";
    config.stream_idle_timeout = std::chrono::seconds(2);
    return config;
  }
  void SetUp() override {
    expect_healthy_service(stub_);
    before_ = resident_bytes();
  }
  void TearDown() override {
    conservation_.check();
    expect_healthy_service(stub_);  // others are served as ever
    if (meshsmooth::testing::kAddressSanitizer) return;
    // What the peer had the server hold goes with it.
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (grown_bytes() >= 64 << 20 && std::chrono::steady_clock::now() < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    EXPECT_LT(grown_bytes(), 64 << 20);
  }

  [[nodiscard]] std::int64_t grown_bytes() const {
    malloc_trim(0);
    return resident_bytes() - before_;
  }
  [[nodiscard]] int port() { return server_.server().port(); }

  InProcessServer server_{config()};
  Stub stub_{grpc::CreateChannel("127.0.0.1:" + std::to_string(server_.server().port()),
                                 grpc::InsecureChannelCredentials())};
  Conservation conservation_{stub_};
  std::int64_t before_ = 0;
};

TEST_F(WireAbuse, GarbageInsteadOfAPreface) {
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    std::string garbage(1 << 14, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    const Peer peer(port());
    peer.send(garbage);
    EXPECT_TRUE(peer.is_sent_away());
  }
}

TEST_F(WireAbuse, GarbageAfterThePreface) {
  std::mt19937 random(2);
  for (int i = 0; i < 50; ++i) {
    std::string garbage(1 << 12, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    const Peer peer(port());
    peer.send(kPreface + frame(kSettings, 0, 0, "") + garbage);
    peer.leave();
  }
}

TEST_F(WireAbuse, ManyHalfOpenConnections) {
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 200; ++i) {
    peers.push_back(std::make_unique<Peer>(port()));
    ASSERT_TRUE(peers.back()->connected());
    if (i % 2 == 0) peers.back()->send(kPreface.substr(0, 10));
  }
  expect_healthy_service(stub_);
}

TEST_F(WireAbuse, RapidReset) {
  const Peer peer(port());
  std::string burst = kPreface + frame(kSettings, 0, 0, "");
  for (std::uint32_t i = 0; i < 5000; ++i) {
    burst += begin_call(2 * i + 1) + frame(kReset, 0, 2 * i + 1, big_endian(8, 4));
    if (i % 100 == 99) {
      if (!peer.send(burst)) break;
      burst.clear();
    }
  }
  expect_healthy_service(stub_);
}

TEST_F(WireAbuse, EndlessContinuation) {
  const Peer peer(port());
  peer.send(kPreface + frame(kSettings, 0, 0, "") + frame(kHeaders, 0, 1, call_headers()));
  std::string filler;
  for (int i = 0; i < 100; ++i)
    filler += header("x-filler-" + std::to_string(i), std::string(100, 'x'));
  for (int i = 0; i < 4000; ++i) {  // 46 MB
    if (!peer.send(frame(kContinuation, 0, 1, filler))) break;
  }
}

TEST_F(WireAbuse, HugeMetadata) {
  for (int i = 0; i < 5; ++i) {
    const Peer peer(port());
    std::string block = call_headers();
    while (block.size() < 15'000) block += header("x-filler", std::string(100, 'x'));
    peer.send(kPreface + frame(kSettings, 0, 0, "") +
              frame(kHeaders, kEndHeaders | kEndStream, 1, block));
    peer.leave();
  }
}

TEST_F(WireAbuse, AMessageThatClaimsFourGigabytes) {
  const Peer peer(port());
  peer.send(kPreface + frame(kSettings, 0, 0, "") + begin_call(1) +
            frame(kData, 0, 1, std::string(1, '\0') + "\xff\xff\xff\xff" + std::string(100, 'x')));
  peer.leave();
}

TEST_F(WireAbuse, MessagesThatAreNone) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    std::string bytes(random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    const Peer peer(port());
    peer.send(kPreface + frame(kSettings, 0, 0, "") + begin_call(1) +
              frame(kData, kEndStream, 1, message(bytes)));
    peer.leave();
  }
}

// A right spec, then the peer is cut off in the middle of a chunk.
TEST_F(WireAbuse, AChunkThatNeverEnds) {
  v1::SmoothRequest spec;
  *spec.mutable_spec() = TwoTetrahedra::spec();
  for (int i = 0; i < 20; ++i) {
    const Peer peer(port());
    peer.send(kPreface + frame(kSettings, 0, 0, "") + begin_call(1) +
              frame(kData, 0, 1, message(spec.SerializeAsString())) +
              frame(kData, 0, 1, std::string(1, '\0') + big_endian(1000, 4) + "half"));
    if (i % 2 == 0) peer.leave();
  }
}

}  // namespace
}  // namespace meshsmooth::testing
