// A crowd at a server that has little memory: whoever cannot be served is told so, and nothing
// else goes wrong.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <barrier>
#include <chrono>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client_access.hpp"
#include "meshsmooth/client.hpp"
#include "support/http.hpp"
#include "support/meshes.hpp"
#include "support/sanitizer.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kHostMemoryLimit = 256 << 20;
constexpr int kConnections = 500, kUploads = 64, kQueue = 2;

/// A line of /proc/PID/status, in bytes.
std::int64_t memory_of(pid_t process, const std::string& what) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(what + ":")) return 1024 * std::stoll(line.substr(what.size() + 1));
  }
  ADD_FAILURE() << "no " << what;
  return 0;
}

class Crowd : public ::testing::Test {
 protected:
  Crowd()
      : server_(0,
                {"--host-memory-limit-bytes", std::to_string(kHostMemoryLimit), "--max-queued-jobs",
                 std::to_string(kQueue), "--admin-listen", "127.0.0.1:0", "--log-level", "info"},
                [] {
                  // Address space would go to stacks that nobody fills.
                  const rlimit stack{1 << 20, 1 << 20};
                  setrlimit(RLIMIT_STACK, &stack);
                }) {
    ceiling_ = static_cast<std::int64_t>(metric("meshsmooth_memory_ceiling_bytes"));
    // What it says, and address space that malloc and stacks take without using it.
    const auto limit =
        static_cast<rlim_t>(memory_of(server_.process().id(), "VmSize") + ceiling_ -
                            memory_of(server_.process().id(), "VmRSS") + (512 << 20));
    const rlimit address_space{limit, limit};
    EXPECT_EQ(prlimit(server_.process().id(), RLIMIT_AS, &address_space, nullptr), 0);
  }

  double metric(const std::string& name) const {
    return parse_metrics(http_get(server_.admin_port(), "/metrics").text).at(name);
  }

  /// A connection of its own.
  client::Client connect() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return client::ClientAccess::make(
        grpc::CreateCustomChannel(server_.target(), grpc::InsecureChannelCredentials(), arguments));
  }

  /// All send the mesh at the same time, each until it has been served. Counts the refusals.
  void rush(std::vector<client::Client>& clients, const Mesh& mesh, const SmoothOptions& options) {
    std::barrier begin(kUploads);
    std::vector<std::jthread> callers;
    for (int i = 0; i < kUploads; ++i) {
      callers.emplace_back([&, i] {
        const auto give_up = std::chrono::steady_clock::now() + 200s;
        begin.arrive_and_wait();
        while (!try_once(clients[static_cast<std::size_t>(i)], mesh, options)) {
          if (std::chrono::steady_clock::now() > give_up) {
            ADD_FAILURE() << "a caller was never served";
            return;
          }
        }
      });
    }
  }

  /// True when it was served, or failed.
  bool try_once(client::Client& client, const Mesh& mesh, const SmoothOptions& options) {
    client::RequestOptions request;
    request.max_attempts = 1;
    Mesh sent = mesh;
    try {
      client.smooth(sent, options, request);
      ++served_;
      return true;
    } catch (const client::ServiceError& error) {
      const std::lock_guard lock(mutex_);
      if (error.code() != client::StatusCode::resource_exhausted || !error.retry_delay()) {
        ADD_FAILURE() << "no honest refusal: " << error.reason() << ": " << error.what();
        return true;
      }
      ++refused_[error.reason()];
    }
    std::this_thread::sleep_for(100ms);  // not as long as they were told: that would be too easy
    return false;
  }

  ServerProgram server_;
  std::int64_t ceiling_ = 0;
  std::mutex mutex_;
  std::map<std::string, int> refused_;
  std::atomic<int> served_ = 0;
};

TEST_F(Crowd, IsServedOrRefusedHonestlyWithinTheMemoryThatWasPublished) {
  std::vector<client::Client> clients;
  for (int i = 0; i < kConnections; ++i) {
    clients.push_back(connect());
    (void)clients.back().server_info();  // so that it is one
  }
  SmoothOptions options;
  options.method = Laplacian{};
  options.quality_detail = QualityDetail::brief;
  options.max_iterations = 1;

  // So large that memory is short before the queue is full; then so small that it is not.
  rush(clients, test::lattice(ElementType::tetrahedron, 36), options);
  rush(clients, test::lattice(ElementType::tetrahedron, 2), options);

  EXPECT_EQ(served_, 2 * kUploads);
  EXPECT_GT(refused_["HOST_MEMORY_BUSY"], 0);
  EXPECT_GT(refused_["QUEUE_FULL"], 0);
  EXPECT_EQ(refused_.size(), 2U);
  const std::int64_t peak = memory_of(server_.process().id(), "VmHWM");
  EXPECT_TRUE(meshsmooth::testing::kAddressSanitizer || peak <= ceiling_);
  std::cout << kConnections << " connections, " << kUploads << " uploads at a time, "
            << refused_["HOST_MEMORY_BUSY"] << " refused for memory, " << refused_["QUEUE_FULL"]
            << " for the queue; peak " << (peak >> 20) << " of " << (ceiling_ >> 20) << " MiB\n";

  // All is given back.
  const auto give_up = std::chrono::steady_clock::now() + 30s;
  while (metric("meshsmooth_reserved_bytes{space=\"host\"}") != 0 &&
         std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(metric("meshsmooth_reserved_bytes{space=\"host\"}"), 0);
  EXPECT_EQ(metric("meshsmooth_streams"), 0);
  EXPECT_EQ(metric("meshsmooth_jobs_total{outcome=\"succeeded\",reason=\"\"}"), served_);
}

}  // namespace
}  // namespace meshsmooth::testing
