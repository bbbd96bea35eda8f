// R7: clients that stop in the middle, or send and take a byte a second.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "meshsmooth/client.hpp"
#include "network/large_mesh.hpp"
#include "server/smooth_call.hpp"
#include "support/process.hpp"
#include "support/relay.hpp"
#include "support/scratch_folder.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr std::size_t kBytes = 48'000'000;
constexpr std::int64_t kSlow = 4'000'000;  // a second

/// A client in a process of its own, over a connection that can be slowed down.
class FarClient {
 public:
  FarClient(const ServerProgram& server, v1::State slow_state)
      : relay_(server.port()),
        process_({"/proc/self/exe", "client", relay_.target(), std::to_string(kBytes)},
                 folder_.path("log")) {
    if (slow_state == v1::STATE_RECEIVING) {
      relay_.slow_down_up(kSlow);
    } else {
      relay_.slow_down_down(kSlow);
    }
  }
  Relay& relay() { return relay_; }
  Process& process() { return process_; }
  [[nodiscard]] std::string log() const { return text_of(folder_.path("log")); }

 private:
  const ScratchFolder folder_;
  Relay relay_;
  Process process_;
};

class StalledPeers : public ::testing::Test {
 protected:
  explicit StalledPeers(int idle_seconds = 2)
      : server_(0, {"--stream-idle-timeout-seconds", std::to_string(idle_seconds)}),
        stub_(server_.connect()) {}

  int jobs_in(v1::State state) {
    v1::ListJobsRequest request;
    request.add_states(state);
    return list_jobs(stub_, request).jobs_size();
  }

  /// Starts so many, each of which stays in the state for seconds, in the midst of its data.
  void start(int count, v1::State state) {
    for (int i = 0; i < count; ++i) clients_.emplace_back(server_, state);
    for (FarClient& client : clients_) {
      const bool up = state == v1::STATE_RECEIVING;
      ASSERT_TRUE(eventually([&] {
        return (up ? client.relay().bytes_up() : client.relay().bytes_down()) > 1'000'000;
      }));
    }
    ASSERT_EQ(jobs_in(state), count);
  }

  std::int64_t resident_bytes() {
    std::ifstream file("/proc/" + std::to_string(server_.process().id()) + "/statm");
    std::int64_t all = 0, pages = 0;
    file >> all >> pages;
    return pages * sysconf(_SC_PAGESIZE);
  }
  std::int64_t reserved_bytes() { return server_info(stub_).backends(0).reserved_bytes(); }

  /// The idle timeout ends all of them, by its name, and their memory comes back.
  void expect_idle_end(int count) {
    const auto begin = Clock::now();
    EXPECT_TRUE(eventually([&] { return jobs_in(v1::STATE_FAILED) == count; }));
    std::cout << "all ended after " << std::chrono::duration<double>(Clock::now() - begin).count()
              << " s\n";
    const v1::ListJobsResponse all = list_jobs(stub_);
    for (const v1::Job& job : all.jobs()) {
      if (job.state() == v1::STATE_FAILED) {
        EXPECT_EQ(job.error().reason(), "STREAM_IDLE");
      }
    }
    EXPECT_TRUE(eventually([&] { return reserved_bytes() == 0; })) << reserved_bytes();
  }

  /// Milliseconds of small jobs one after another, ascending.
  std::vector<double> latencies(int count) {
    client::Client client(server_.target());
    SmoothOptions options;
    options.method = SmartLaplacian{};
    options.max_iterations = 1;
    std::vector<double> all;
    for (int i = 0; i < count; ++i) {
      Mesh mesh = mesh_of_bytes(10'000);
      const auto begin = Clock::now();
      client.smooth(mesh, options, {});
      all.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  ServerProgram server_;
  Stub stub_;
  std::list<FarClient> clients_;
};

TEST_F(StalledPeers, StoppedUploadsAreEndedAndTold) {
  start(2, v1::STATE_RECEIVING);
  for (FarClient& client : clients_) client.process().signal(SIGSTOP);
  for (FarClient& client : clients_) client.relay().slow_down(0);
  expect_idle_end(2);
  for (FarClient& client : clients_) {
    client.process().signal(SIGCONT);
    EXPECT_EQ(client.process().wait(), 1);
    EXPECT_THAT(client.log(), HasSubstr("STREAM_IDLE"));
  }
}

TEST_F(StalledPeers, StoppedDownloadsAreEnded) {
  start(2, v1::STATE_SENDING);
  for (FarClient& client : clients_) client.process().signal(SIGSTOP);
  for (FarClient& client : clients_) client.relay().slow_down(0);
  expect_idle_end(2);
  for (FarClient& client : clients_) {
    client.process().signal(SIGCONT);
    EXPECT_EQ(client.process().wait(), 1) << client.log();
  }
}

TEST_F(StalledPeers, UploadsOfAByteASecondAreEnded) {
  start(2, v1::STATE_RECEIVING);
  for (FarClient& client : clients_) client.relay().slow_down(1);
  expect_idle_end(2);
}

TEST_F(StalledPeers, DownloadsOfAByteASecondAreEnded) {
  start(2, v1::STATE_SENDING);
  for (FarClient& client : clients_) client.relay().slow_down(1);
  expect_idle_end(2);
}

class PatientlyStalledPeers : public StalledPeers {
 protected:
  PatientlyStalledPeers() : StalledPeers(600) {}
};

// What they hold is what was promised to them, and nobody else waits for them.
TEST_F(PatientlyStalledPeers, HoldTheirPromiseAndNobodyElseUp) {
  constexpr int kPeers = 6;
  latencies(20);
  const std::vector<double> alone = latencies(100);
  const std::int64_t before = resident_bytes();
  start(kPeers, v1::STATE_RECEIVING);
  for (FarClient& client : clients_) client.process().signal(SIGSTOP);
  const std::int64_t promised = reserved_bytes();
  const std::vector<double> beside = latencies(100);
  const std::int64_t held = resident_bytes() - before;

  std::cout << kPeers << " stalled uploads hold " << (held >> 20) << " MiB of " << (promised >> 20)
            << " MiB promised; a job of 10 KB: p50 " << alone[50] << " ms, p99 " << alone[98]
            << " ms alone, p50 " << beside[50] << " ms, p99 " << beside[98] << " ms beside them\n";
  EXPECT_LE(held, promised);
  EXPECT_LE(beside[50], 10 * alone[50] + 50);
}

}  // namespace
}  // namespace meshsmooth::testing
