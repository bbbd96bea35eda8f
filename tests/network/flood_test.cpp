// Floods of HTTP/2 frames by peers that keep to no limit, and what another caller feels meanwhile:
// through HAProxy and nginx with the configurations that we ship, and with a new gRPC without them.
#include <grpcpp/version_info.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "network/proxy.hpp"
#include "server/smooth_call.hpp"
#include "support/http.hpp"
#include "support/http2_peer.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// Machines of CI are slow, and attackers have cores too.
constexpr Seconds kLongestAnswer(1);
constexpr int kProbes = 40;

/// What one connection sends, batch by batch, after the preface.
struct Flood {
  std::string name;
  std::function<std::string(std::uint32_t)> batch;
  bool acknowledges = false;  // the server's settings, and so its limits
  int attackers = 4;
};

std::string calls(std::uint32_t batch, const std::function<std::string(std::uint32_t)>& call) {
  constexpr std::uint32_t kCalls = 100;
  std::string frames;
  for (std::uint32_t i = 0; i < kCalls; ++i) frames += call(2 * (kCalls * batch + i) + 1);
  return frames;
}

std::string repeat(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

std::vector<Flood> floods() {
  const auto rapid_reset = [](std::uint32_t batch) {
    return calls(batch, [](std::uint32_t stream) {
      return begin_call(stream) + frame(kReset, 0, stream, big_endian(8, 4));
    });
  };
  const auto server_info = [](std::uint32_t batch) {
    return calls(batch, [](std::uint32_t stream) {
      return frame(kHeaders, kEndHeaders, stream, call_headers("GetServerInfo")) +
             frame(kData, kEndStream, stream, message(""));
    });
  };
  const auto open_calls = [](std::uint32_t batch) { return calls(batch, begin_call); };
  const auto endless_headers = [](std::uint32_t batch) {
    std::string filler;
    for (int i = 0; i < 100; ++i) filler += header("x-" + std::to_string(i), std::string(100, 'x'));
    return (batch == 0 ? frame(kHeaders, 0, 1, call_headers()) : "") +
           repeat(frame(kContinuation, 0, 1, filler), 20);
  };
  const auto endless_string = [](std::uint32_t batch) {
    // A name of one letter, and a value of a gigabyte.
    const std::string begin = std::string("\x10\x01x\x7f", 4) + "\x81\xff\xff\xff\x03";
    return (batch == 0 ? frame(kHeaders, 0, 1, call_headers() + begin) : "") +
           frame(kContinuation, 0, 1, std::string(16384, 'y'));
  };
  const auto empty_data = [](std::uint32_t batch) {
    return (batch == 0 ? begin_call(1) : "") + repeat(frame(kData, 0, 1, ""), 1800);
  };
  const auto pings = [](std::uint32_t) { return repeat(frame(kPing, 0, 0, "12345678"), 500); };
  const auto settings = [](std::uint32_t batch) {
    return repeat(frame(kSettings, 0, 0, big_endian(4, 2) + big_endian(65535 + batch % 2, 4)), 500);
  };
  return {{"resets", rapid_reset},
          {"resets of a client that knows the limits", rapid_reset, true},
          {"GetServerInfo", server_info},
          {"open calls", open_calls},
          {"headers without end", endless_headers},
          {"a string without end", endless_string},
          // More than gRPC has threads for connections.
          {"strings without end by many", endless_string, true, 20},
          // None of which sends much.
          {"strings without end by very many", endless_string, true, 80},
          {"empty data", empty_data},
          {"pings", pings},
          {"settings", settings}};
}

class Attackers {
 public:
  Attackers(int port, const Flood& flood) {
    for (int i = 0; i < flood.attackers; ++i) {
      threads_.emplace_back([this, port, &flood] {
        while (!stopped_) attack(port, flood);
      });
    }
  }
  ~Attackers() {
    stopped_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  Attackers(const Attackers&) = delete;
  Attackers& operator=(const Attackers&) = delete;

  [[nodiscard]] int batches() const { return batches_; }

 private:
  // Until it is cut off.
  void attack(int port, const Flood& flood) {
    const Peer peer(port);
    peer.send(kPreface + frame(kSettings, 0, 0, "") +
              (flood.acknowledges ? frame(kSettings, kAck, 0, "") : ""));
    for (std::uint32_t i = 0; !stopped_; ++i) {
      if (!peer.send(flood.batch(i)) || (i % 8 == 0 && !peer.skip_answers())) return;
      ++batches_;
    }
  }

  std::atomic<bool> stopped_ = false;
  std::atomic<int> batches_ = 0;
  std::vector<std::thread> threads_;
};

std::int64_t count_of(pid_t process, const std::string& what) {
  const std::filesystem::directory_iterator entries("/proc/" + std::to_string(process) + "/" +
                                                    what);
  return std::distance(begin(entries), end(entries));
}

std::int64_t resident_bytes(pid_t process) {
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  std::int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

std::int64_t memory_ceiling(int admin_port) {
  const std::string metrics = http_get(admin_port, "/metrics").text;
  const std::string name = "\nmeshsmooth_memory_ceiling_bytes ";
  return static_cast<std::int64_t>(std::stod(metrics.substr(metrics.find(name) + name.size())));
}

class Floods : public ::testing::Test {
 protected:
  Floods()
      : server_(0, {"--admin-listen", "127.0.0.1:0", "--host-memory-limit-bytes", "256MiB",
                    "--log-level", "info"}) {}

  /// Of a small job; an hour if it fails.
  Seconds answer_time() {
    const auto begin = Clock::now();
    SmoothCall call(*stub_, std::chrono::system_clock::now() + std::chrono::seconds(30));
    call.send_all(TwoTetrahedra());
    if (!call.finish().ok()) return std::chrono::hours(1);
    return Clock::now() - begin;
  }

  void expect_others_served(int port);
  void expect_others_served_behind(ProxyKind kind);

  ServerProgram server_;
  std::unique_ptr<Stub> stub_;
};

void Floods::expect_others_served(int port) {
  stub_ = std::make_unique<Stub>(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  // A proxy has to find the server ready first.
  ASSERT_TRUE(eventually([&] { return answer_time() < kLongestAnswer; }));
  const pid_t process = server_.process().id();
  const std::int64_t ceiling = memory_ceiling(server_.admin_port());
  const std::int64_t threads = count_of(process, "task"), descriptors = count_of(process, "fd");
  for (const Flood& flood : floods()) {
    SCOPED_TRACE(flood.name);
    std::vector<Seconds> times;
    std::int64_t resident = 0;
    {
      const Attackers attackers(port, flood);
      ASSERT_TRUE(eventually([&] { return attackers.batches() > flood.attackers; }));
      for (int i = 0; i < kProbes; ++i) {
        times.push_back(answer_time());
        resident = std::max(resident, resident_bytes(process));
      }
      EXPECT_EQ(http_get(server_.admin_port(), "/readyz").status, 200);
    }
    std::ranges::sort(times);
    EXPECT_LE(times[kProbes / 2], kLongestAnswer);
    // One of many may come just when the machine has other things to do.
    EXPECT_LE(times[kProbes - 2], kLongestAnswer * 2)
        << "the median is " << times[kProbes / 2].count();
    EXPECT_LE(resident, ceiling);
    EXPECT_LT(answer_time(), kLongestAnswer * 2);
    EXPECT_TRUE(eventually([&] { return count_of(process, "fd") <= descriptors + 8; }));
    EXPECT_TRUE(eventually([&] { return count_of(process, "task") <= threads + 16; }));
    std::printf("%s: %.1f ms, at worst %.1f ms, %ld MiB\n", flood.name.c_str(),
                1e3 * times[kProbes / 2].count(), 1e3 * times.back().count(),
                static_cast<long>(resident >> 20));
  }
}

void Floods::expect_others_served_behind(ProxyKind kind) {
  const std::string program = name_of(kind);
  if (find_program(program).empty()) {
    GTEST_SKIP() << "WARNING: " << program << " is not installed (apt-get install " << program
                 << "): the floods through it are SKIPPED";
  }
  const Proxy proxy(kind, {Proxy::Backend{server_.port(), server_.admin_port()}});
  expect_others_served(proxy.port());
}

TEST_F(Floods, LeaveOthersServedBehindSampleConfig) {
  expect_others_served_behind(ProxyKind::haproxy);
}

TEST_F(Floods, LeaveOthersServedBehindNginxSampleConfig) {
  expect_others_served_behind(ProxyKind::nginx);
}

TEST_F(Floods, LeaveOthersServedWithoutProxy) {
  if (GRPC_CPP_VERSION_MAJOR == 1 && GRPC_CPP_VERSION_MINOR < 66) {
    GTEST_SKIP() << "gRPC " GRPC_CPP_VERSION_STRING " does not survive them";
  }
  expect_others_served(server_.port());
}

}  // namespace
}  // namespace meshsmooth::testing
