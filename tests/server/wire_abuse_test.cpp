// Peers that do not speak the protocol, or speak it to do harm, by hand-made HTTP/2 frames.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/http2_peer.hpp"
#include "support/in_process_server.hpp"
#include "support/sanitizer.hpp"

namespace meshsmooth::testing {
namespace {

std::int64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

grpc::ChannelArguments own_connection() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
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

struct ReceivedFrame {
  int kind, flags;
  std::string payload;
};

/// Those that are complete.
std::vector<ReceivedFrame> frames_of(const std::string& bytes) {
  constexpr std::size_t kHead = 9;
  std::vector<ReceivedFrame> frames;
  for (std::size_t at = 0; at + kHead <= bytes.size();) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[at + i]); };
    const std::size_t size = byte(0) << 16 | byte(1) << 8 | byte(2);
    if (at + kHead + size > bytes.size()) break;
    frames.push_back({byte(3), byte(4), bytes.substr(at + kHead, size)});
    at += kHead + size;
  }
  return frames;
}

/// Of that kind, with all of the flags.
int count_frames(const std::string& bytes, int kind, int flags = 0) {
  const std::vector<ReceivedFrame> frames = frames_of(bytes);
  return static_cast<int>(std::ranges::count_if(frames, [&](const ReceivedFrame& frame) {
    return frame.kind == kind && (frame.flags & flags) == flags;
  }));
}

/// Whether the summary, which comes last, is among the messages of the only call.
bool has_summary(const std::string& bytes) {
  constexpr std::size_t kPrefix = 5;
  std::string data;
  for (const ReceivedFrame& frame : frames_of(bytes)) {
    if (frame.kind == kData) data += frame.payload;
  }
  for (std::size_t at = 0; at + kPrefix <= data.size();) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(data[at + i]); };
    const std::size_t size = byte(1) << 24 | byte(2) << 16 | byte(3) << 8 | byte(4);
    v1::SmoothResponse response;
    if (at + kPrefix + size <= data.size() &&
        response.ParseFromString(data.substr(at + kPrefix, size)) && response.has_summary()) {
      return true;
    }
    at += kPrefix + size;
  }
  return false;
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

// The limit of streams that gRPC announces binds a client only once it has acknowledged it.
TEST_F(WireAbuse, CallsWithoutEndOfAClientThatIgnoresTheLimit) {
  const Peer peer(port());
  std::string burst = kPreface + frame(kSettings, 0, 0, "");
  for (std::uint32_t i = 0; i < 2000; ++i) burst += begin_call(2 * i + 1);
  peer.send(burst);
  // This server ends the connection; a newer gRPC resets what is too many before it does.
  const std::string answer = peer.read_all();
  EXPECT_TRUE(peer.is_sent_away() || count_frames(answer, kReset) > 2000 - 300);
}

TEST_F(WireAbuse, MoreConnectionsThanAreServed) {
  // One that says nothing makes room; see ListenerTest for the limits themselves.
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 1100; ++i) peers.push_back(std::make_unique<Peer>(port()));
  Stub other(grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port()),
                                       grpc::InsecureChannelCredentials(), own_connection()));
  expect_healthy_service(other);
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

// HAProxy resets a stream whose answer has ended before the request has, and clients of gRPC then
// take a job that succeeded for one that was cancelled.
TEST_F(WireAbuse, AResultThatComesBeforeTheHalfClose) {
  const auto data = [](const v1::SmoothRequest& request) {
    return frame(kData, 0, 1, message(request.SerializeAsString()));
  };
  const TwoTetrahedra mesh;
  v1::SmoothRequest spec, elements, fixed, coordinates;
  *spec.mutable_spec() = TwoTetrahedra::spec();
  *elements.mutable_chunk() = chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh.elements);
  *fixed.mutable_chunk() = chunk(v1::ARRAY_ID_FIXED_MASK, 0, mesh.fixed);
  *coordinates.mutable_chunk() = chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh.coordinates));
  const Peer peer(port());
  peer.send(kPreface + frame(kSettings, 0, 0, "") + begin_call(1) + data(spec) + data(elements) +
            data(fixed) + data(coordinates));
  std::string answer;
  const auto read_until = [&](const auto& done) {
    while (!done()) {
      const std::string more = peer.read_some();
      if (more.empty()) return false;
      answer += more;
    }
    return true;
  };
  ASSERT_TRUE(read_until([&] { return has_summary(answer); }));
  peer.send(frame(kPing, 0, 0, "12345678"));
  ASSERT_TRUE(read_until([&] { return count_frames(answer, kPing, kAck) > 0; }));
  EXPECT_EQ(count_frames(answer, kHeaders, kEndStream), 0) << "the status came too early";
  peer.send(frame(kData, kEndStream, 1, ""));
  EXPECT_TRUE(read_until([&] { return count_frames(answer, kHeaders, kEndStream) > 0; }));
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
