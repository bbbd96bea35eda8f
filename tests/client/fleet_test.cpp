// Several servers under one name: who gets the jobs, and what becomes of those of a server that
// leaves.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "meshsmooth/client.hpp"
#include "mock_service.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using meshsmooth::testing::InProcessServer;
using meshsmooth::testing::MockServer;
using meshsmooth::testing::ServerStream;

constexpr auto kPatience = std::chrono::seconds(60);

std::unique_ptr<InProcessServer> serve(const std::string& listen,
                                       std::chrono::seconds lame_duck = {}) {
  server::ServerConfig config = meshsmooth::testing::quiet_config();
  config.listen = listen;
  config.lanes = 1;
  config.lame_duck = lame_duck;
  return std::make_unique<InProcessServer>(config);
}

using Servers = std::vector<std::unique_ptr<InProcessServer>>;

std::string address_of(const std::vector<int>& ports) {
  std::string list;
  for (const int port : ports) {
    list += (list.empty() ? "ipv4:127.0.0.1:" : ",127.0.0.1:") + std::to_string(port);
  }
  return list;
}

std::string address_of(const Servers& servers) {
  std::vector<int> ports;
  for (const auto& server : servers) ports.push_back(server->server().port());
  return address_of(ports);
}

std::vector<int> started(const Servers& servers) {
  std::vector<int> counts;
  for (const auto& server : servers) counts.push_back(server->fake().started());
  return counts;
}

/// A job, whose answer must be right.
void run_job(Client& client) {
  Mesh mesh = test::tet_ball();
  RequestOptions request;
  request.timeout = kPatience;
  client.smooth(mesh, {}, request);
  EXPECT_EQ(test::points(mesh)[0].x, test::points(test::tet_ball())[0].x + 1);
}

/// Runs jobs one after another until it is so.
template <class Condition>
void run_jobs_until(Client& client, const Condition& is_so) {
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  while (!is_so()) {
    ASSERT_LT(std::chrono::steady_clock::now(), limit);
    run_job(client);
  }
}

TEST(Fleet, SendsJobsInTurnToAllServersOfAList) {
  Servers servers;
  for (int i = 0; i < 3; ++i) servers.push_back(serve("127.0.0.1:0"));
  Client client(address_of(servers));
  run_jobs_until(client,
                 [&] { return !::testing::Value(started(servers), ::testing::Contains(0)); });
  const std::vector<int> before = started(servers);
  for (int i = 0; i < 30; ++i) run_job(client);
  for (std::size_t i = 0; i < servers.size(); ++i) {
    EXPECT_EQ(servers[i]->fake().started(), before[i] + 10) << i;
  }
}

TEST(Fleet, LeavesOutAServerFromTheFirstMomentOfItsDrain) {
  Servers servers;
  servers.push_back(serve("127.0.0.1:0", std::chrono::seconds(600)));
  servers.push_back(serve("127.0.0.1:0"));
  Client client(address_of(servers));
  run_jobs_until(client,
                 [&] { return !::testing::Value(started(servers), ::testing::Contains(0)); });

  std::thread drain([&] { servers[0]->drain(); });
  // It goes on accepting calls, but by Watch the client knows soon that it should send none.
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  for (int row = 0; row < 20; ++row) {
    const int before = servers[0]->fake().started();
    run_job(client);
    if (servers[0]->fake().started() != before) row = 0;
    if (std::chrono::steady_clock::now() > limit) {
      ADD_FAILURE() << "jobs still go to the server that drains";
      break;
    }
  }
  Client direct("127.0.0.1:" + std::to_string(servers[0]->server().port()));
  run_job(direct);
  servers[0]->server().force_shutdown();
  drain.join();
}

// The running one is stopped, the waiting ones are rejected as draining; none is lost.
TEST(Fleet, EndsElsewhereWhatADrainingServerHadAccepted) {
  Servers servers;
  for (int i = 0; i < 2; ++i) servers.push_back(serve("127.0.0.1:0"));
  Client client(address_of(servers));
  run_jobs_until(client,
                 [&] { return !::testing::Value(started(servers), ::testing::Contains(0)); });
  const std::vector<int> before = started(servers);
  for (const auto& server : servers) server->fake().hold();
  std::vector<std::thread> callers;
  std::atomic<int> answers = 0;
  for (int i = 0; i < 8; ++i) {
    callers.emplace_back([&] {
      run_job(client);
      ++answers;
    });
  }
  for (std::size_t i = 0; i < servers.size(); ++i) servers[i]->fake().wait_started(before[i] + 1);
  servers[0]->drain();
  EXPECT_EQ(answers, 0);
  servers[1]->fake().release();
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(answers, 8);
}

TEST(Fleet, SendsTheSameRequestElsewhereWhenAServerDies) {
  std::atomic<bool> died = false;
  std::vector<std::string> ids;  // one call at a time
  std::array<MockServer, 2> servers;
  std::jthread killer;
  for (MockServer& server : servers) {
    server.service.on_smooth = [&](grpc::ServerContext& context, ServerStream& stream) {
      ids.push_back(meshsmooth::testing::read_spec(stream).request_id());
      meshsmooth::testing::accept(stream);
      meshsmooth::testing::read_upload(stream);
      if (died.exchange(true)) {
        return meshsmooth::testing::refusal(grpc::StatusCode::INVALID_ARGUMENT, "ENOUGH",
                                            "elsewhere");
      }
      killer = std::jthread([&server] { server.die(); });
      while (!context.IsCancelled()) std::this_thread::yield();
      return grpc::Status::CANCELLED;
    };
  }
  Client client("ipv4:" + servers[0].address() + "," + servers[1].address());
  Mesh mesh = test::tet_ball();
  try {
    client.smooth(mesh, {});
    FAIL() << "no error";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "ENOUGH");
  }
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(ids[0], ids[1]);
}

/// Answers every question for an address with all of these, until it goes.
class NameServer {
 public:
  explicit NameServer(std::vector<std::string> addresses)
      : addresses_(std::move(addresses)), socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    if (bind(socket_, reinterpret_cast<sockaddr*>(&own), size) != 0 ||
        getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size) != 0) {
      throw std::runtime_error("no socket for names");
    }
    port_ = ntohs(own.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~NameServer() {
    stopping_ = true;
    thread_.join();
    close(socket_);
  }
  NameServer(const NameServer&) = delete;
  NameServer& operator=(const NameServer&) = delete;

  [[nodiscard]] int port() const { return port_; }

 private:
  void run() {
    while (!stopping_) {
      pollfd file{socket_, POLLIN, 0};
      if (poll(&file, 1, 20) != 1) continue;
      std::array<char, 512> question{};
      sockaddr_in who{};
      socklen_t size = sizeof who;
      const ssize_t length = recvfrom(socket_, question.data(), question.size(), 0,
                                      reinterpret_cast<sockaddr*>(&who), &size);
      if (length < 17) continue;
      const std::string text = answer({question.data(), static_cast<std::size_t>(length)});
      sendto(socket_, text.data(), text.size(), 0, reinterpret_cast<sockaddr*>(&who), size);
    }
  }
  // RFC 1035: header, question, and for type A an answer each that points at the question's name.
  [[nodiscard]] std::string answer(const std::string& asked) const {
    constexpr std::size_t kHeader = 12;
    const std::size_t end = std::min(asked.find('\0', kHeader) + 5, asked.size());
    const bool wants_ipv4 = asked[end - 3] == 1;
    std::string text = asked.substr(0, 2) + std::string("\x84\x00\x00\x01\x00", 5) +
                       static_cast<char>(wants_ipv4 ? addresses_.size() : 0) +
                       std::string(4, '\0') + asked.substr(kHeader, end - kHeader);
    for (const std::string& address : addresses_) {
      if (!wants_ipv4) break;
      in_addr ip{};
      inet_pton(AF_INET, address.c_str(), &ip);
      text += std::string("\xc0\x0c\x00\x01\x00\x01\x00\x00\x00\x01\x00\x04", 12) +
              std::string(reinterpret_cast<const char*>(&ip), sizeof ip);
    }
    return text;
  }

  const std::vector<std::string> addresses_;
  const int socket_;
  int port_ = 0;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

// As a headless Service of Kubernetes; one of its pods is gone without a word.
TEST(Fleet, SendsJobsToAllThatANameResolvesTo) {
  Servers servers;
  servers.push_back(serve("127.0.0.1:0"));
  const std::string port = std::to_string(servers[0]->server().port());
  servers.push_back(serve("127.0.0.2:" + port));
  const NameServer names({"127.0.0.1", "127.0.0.2", "127.0.0.3"});
  Client client("dns://127.0.0.1:" + std::to_string(names.port()) + "/fleet.test:" + port);
  run_jobs_until(client,
                 [&] { return !::testing::Value(started(servers), ::testing::Contains(0)); });
  const std::vector<int> before = started(servers);
  for (int i = 0; i < 10; ++i) run_job(client);
  EXPECT_EQ(started(servers), (std::vector<int>{before[0] + 5, before[1] + 5}));
}

// An address alone is no fleet: a server that drains still says itself what it has.
TEST(Fleet, AsksAServerAloneThoughItDrains) {
  const auto server = serve("127.0.0.1:0", std::chrono::seconds(600));
  Client client("127.0.0.1:" + std::to_string(server->server().port()));
  EXPECT_TRUE(client.healthy());
  std::thread drain([&] { server->drain(); });
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  while (client.healthy() && std::chrono::steady_clock::now() < limit) std::this_thread::yield();
  EXPECT_FALSE(client.healthy());
  EXPECT_NO_THROW((void)client.server_info());
  server->server().force_shutdown();
  drain.join();
}

}  // namespace
}  // namespace meshsmooth::client
