// The service behind HAProxy and nginx, with the configurations that we ship and with wrong ones.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <future>
#include <thread>

#include "meshsmooth/client.hpp"
#include "network/large_mesh.hpp"
#include "network/proxy.hpp"
#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"
#include "wire/crc32c.hpp"

namespace meshsmooth::testing {
namespace {

using client::ServiceError;
using grpc::StatusCode;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

// Of everything that has to arrive always.
constexpr int kTries = 12;

/// How long a call is silent in the tests of pauses; 70 shows that no minute's timeout is left.
std::chrono::duration<double> pause() {
  const char* const seconds = std::getenv("MESHSMOOTH_PROXY_PAUSE_SECONDS");
  return std::chrono::duration<double>(seconds == nullptr ? 1.5 : std::atof(seconds));
}

server::ServerConfig tcp_config() {
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  return config;
}
/// Asked by HAProxy whether it is ready; its admin server takes 2 s to stop.
server::ServerConfig watched_config() {
  server::ServerConfig config = tcp_config();
  config.admin_listen = "127.0.0.1:0";
  return config;
}

Proxy::Backend backend(InProcessServer& server) {
  return {server.server().port(), server.server().admin_port()};
}

Stub connect(const Proxy& proxy) {
  return Stub(grpc::CreateChannel(proxy.target(), grpc::InsecureChannelCredentials()));
}

/// The error of a request that must fail.
ServiceError error_of(const std::function<void()>& request) {
  try {
    request();
  } catch (const ServiceError& error) {
    return error;
  }
  ADD_FAILURE() << "nothing thrown";
  return {client::StatusCode::unknown, "", "", {}, ""};
}

/// The call sends chunks until it is told to stop or has ended, as clients do; then its status
/// is there. `before_chunk` is asked before each whether its checksum is to be right.
void send_until_stopped(
    SmoothCall& call, const std::function<bool(int)>& before_chunk = [](int) { return true; }) {
  std::atomic<bool> stopped = false;
  std::thread sender([&] {
    const std::string data(256 << 10, '\0');
    for (int i = 0; !stopped; ++i) {
      v1::Chunk next = chunk(v1::ARRAY_ID_ELEMENTS, std::int64_t{i} << 18, data);
      next.set_crc32c(wire::crc32c(std::as_bytes(std::span(data))) + (before_chunk(i) ? 0 : 1));
      if (!call.send(std::move(next))) return;
    }
    call.half_close();
  });
  for (auto response = call.read(); response && !response->has_stop_sending();) {
    response = call.read();
  }
  stopped = true;
  sender.join();
  call.finish();
}

/// A spec whose data never ends, as far as a test is concerned.
v1::JobSpec huge_spec() {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(1 << 26);
  return spec;
}

class BehindProxy : public ::testing::TestWithParam<ProxyKind> {
 protected:
  void SetUp() override {
    if (find_program(name_of(GetParam())).empty()) {
      GTEST_SKIP() << "WARNING: " << name_of(GetParam()) << " is not installed (apt-get install "
                   << name_of(GetParam()) << "): the tests behind it are SKIPPED";
    }
  }

  [[nodiscard]] bool is_haproxy() const { return GetParam() == ProxyKind::haproxy; }
};

class BehindSampleConfig : public BehindProxy {
 protected:
  void SetUp() override {
    BehindProxy::SetUp();
    if (IsSkipped()) return;
    proxy_ = std::make_unique<Proxy>(GetParam(), std::vector{backend(server_)});
    stub_ = std::make_unique<Stub>(connect(*proxy_));
  }

  static server::ServerConfig config() {
    server::ServerConfig config = tcp_config();
    config.host_memory_limit_bytes = std::int64_t{4} << 30;
    config.max_node_count = 20'000'000;
    return config;
  }

  void cancel(const std::string& name) {
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_name(name);
    v1::CancelJobResponse response;
    EXPECT_TRUE(stub_->CancelJob(&context, request, &response).ok());
  }

  InProcessServer server_{config()};
  std::unique_ptr<Proxy> proxy_;
  std::unique_ptr<Stub> stub_;
};

// --- meshes of any size -------------------------------------------------------------

TEST_P(BehindSampleConfig, MeshesOf100KilobytesToMoreThanAnyLimitPass) {
  const char* const most = std::getenv("MESHSMOOTH_PROXY_MEGABYTES");
  client::Client client(proxy_->target());
  for (const std::size_t megabytes : {0UL, 1UL, 14UL, most == nullptr ? 48UL : std::stoul(most)}) {
    expect_smoothed(client, mesh_of_bytes(megabytes == 0 ? 100'000 : megabytes * 1'000'000));
  }
}

// --- refusals and errors ------------------------------------------------------------

TEST_P(BehindSampleConfig, RefusalsBeforeTheDataArriveAlways) {
  for (int i = 0; i < kTries; ++i) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.mutable_inline_topology()->set_node_count(20'000'001);
    SmoothCall call(*stub_);
    call.send(spec);
    EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED)
        << call.finish().error_message();
    EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
    EXPECT_TRUE(call.was_told_to_stop());
  }
}

TEST_P(BehindSampleConfig, RefusalsOfAClientThatAlreadySendsArriveAlways) {
  for (int i = 0; i < kTries; ++i) {
    v1::JobSpec spec = huge_spec();
    spec.mutable_inline_topology()->set_node_count(20'000'001);
    SmoothCall call(*stub_);
    call.send(spec);
    send_until_stopped(call);
    EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED)
        << call.finish().error_message();
    EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
  }
}

TEST_P(BehindSampleConfig, ErrorsInMidUploadArriveAlways) {
  for (int i = 0; i < kTries; ++i) {
    SmoothCall call(*stub_);
    call.send(huge_spec());
    call.read_accepted();
    send_until_stopped(call, [&](int chunk) { return chunk != 3 + 5 * i; });
    EXPECT_EQ(call.finish().error_code(), StatusCode::DATA_LOSS) << call.finish().error_message();
    EXPECT_EQ(call.details().reason, "CHECKSUM_MISMATCH");
    EXPECT_EQ(call.detail("offset_bytes"), std::to_string((3 + 5 * i) << 18));
  }
}

TEST_P(BehindSampleConfig, AnEndFromOutsideInMidUploadArrivesAlways) {
  for (int i = 0; i < kTries; ++i) {
    SmoothCall call(*stub_);
    call.send(huge_spec());
    const std::string name = call.read_accepted();
    send_until_stopped(call, [&](int chunk) {
      if (chunk == 2 + 3 * i) cancel(name);
      return true;
    });
    EXPECT_EQ(call.finish().error_code(), StatusCode::CANCELLED) << call.finish().error_message();
    EXPECT_EQ(call.details().reason, "CANCELLED_BY_JOB_CALL");
  }
}

TEST_P(BehindSampleConfig, TheClientLibraryHasStatusReasonAndFacts) {
  client::Client client(proxy_->target());
  for (int i = 0; i < kTries; ++i) {
    Mesh mesh = mesh_of_bytes(2'000'000);
    server_.fake().fail_with([] {
      throw InvalidMesh("INDEX_OUT_OF_RANGE", "element 1: node 9", {{"element", "1"}});
    });
    const ServiceError error =
        error_of([&] { client.smooth(mesh, {.method = SmartLaplacian{}}, {}); });
    EXPECT_EQ(error.code(), client::StatusCode::invalid_argument) << error.what();
    EXPECT_EQ(error.reason(), "INDEX_OUT_OF_RANGE");
    EXPECT_EQ(error.details(), (ErrorDetails{{"element", "1"}}));
  }
}

TEST_P(BehindSampleConfig, SilenceOnBothSidesBreaksNothing) {
  client::Client client(proxy_->target());
  server_.fake().hold();
  std::jthread releaser([&] {
    server_.fake().wait_started(1);
    std::this_thread::sleep_for(pause());
    server_.fake().release();
  });
  expect_smoothed(client, mesh_of_bytes(1'000'000));  // asks for no progress
}

TEST_P(BehindSampleConfig, AClientThatDoesNotReadHoldsUpNobody) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  constexpr std::int64_t kNodes = 1 << 20;
  spec.mutable_inline_topology()->set_node_count(kNodes);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  SmoothCall stalled(*stub_);
  stalled.send(spec);
  const std::string name = stalled.read_accepted();
  stalled.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, TwoTetrahedra().elements));
  for (std::int64_t i = 0; i < 24; ++i) {
    stalled.send(chunk(v1::ARRAY_ID_COORDINATES, i << 20, std::string(1 << 20, '\0')));
  }
  Stub direct(server_.channel());
  wait_for_state(direct, name, v1::STATE_SENDING);

  client::Client other(proxy_->target());
  for (int i = 0; i < 4; ++i) expect_smoothed(other, mesh_of_bytes(3'000'000));

  EXPECT_EQ(get_job(direct, name).state(), v1::STATE_SENDING);
  EXPECT_TRUE(stalled.finish().ok()) << stalled.finish().error_message();
  EXPECT_EQ(stalled.result().size(), 24U * kNodes);
}

INSTANTIATE_TEST_SUITE_P(All, BehindSampleConfig,
                         ::testing::Values(ProxyKind::haproxy, ProxyKind::nginx),
                         [](const auto& test) { return name_of(test.param); });

// --- several servers ----------------------------------------------------------------

class BeforeSeveralServers : public BehindProxy {
 protected:
  void start(std::size_t count, server::ServerConfig config = tcp_config()) {
    std::vector<Proxy::Backend> backends;
    for (std::size_t i = 0; i < count; ++i) {
      servers_.push_back(std::make_unique<InProcessServer>(config));
      servers_.back()->keeps_something();  // topologies
      backends.push_back(backend(*servers_.back()));
    }
    proxy_ = std::make_unique<Proxy>(GetParam(), backends);
  }
  [[nodiscard]] std::vector<int> started() const {
    std::vector<int> counts;
    for (const auto& server : servers_) counts.push_back(server->fake().started());
    return counts;
  }

  std::vector<std::unique_ptr<InProcessServer>> servers_;
  std::unique_ptr<Proxy> proxy_;
};

TEST_P(BeforeSeveralServers, TheStepsOfAMovingMeshGoToOne) {
  start(3);
  client::Client client(proxy_->target());
  std::vector<std::size_t> used;
  for (int cells = 1; cells <= 8; ++cells) {
    const Mesh mesh = test::lattice(ElementType::tetrahedron, cells);
    std::vector<Vec3d> positions = std::get<std::vector<Vec3d>>(mesh.positions);
    const std::vector<int> before = started();
    client::Session session = client.open(mesh);
    for (int step = 0; step < 4; ++step)
      session.smooth(positions, {.method = SmartLaplacian{}}, {});
    const std::vector<int> after = started();
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (after[i] == before[i]) continue;
      EXPECT_EQ(after[i] - before[i], 4);
      used.push_back(i);
    }
  }
  EXPECT_EQ(used.size(), 8U);  // a server each
  std::sort(used.begin(), used.end());
  EXPECT_GT(std::unique(used.begin(), used.end()) - used.begin(), 1) << "all to the same";
}

TEST_P(BeforeSeveralServers, CallsWithoutTopologyAreSpread) {
  start(3);
  client::Client client(proxy_->target());
  for (int i = 0; i < 48; ++i) expect_smoothed(client, mesh_of_bytes(1000));
  EXPECT_THAT(started(), ::testing::Each(::testing::Gt(4)));
}

TEST_P(BeforeSeveralServers, OneThatIsGoneIsNotMissed) {
  start(3);
  servers_.front()->drain();  // its port is closed
  client::Client client(proxy_->target());
  for (int i = 0; i < kTries; ++i) expect_smoothed(client, mesh_of_bytes(100'000));
}

// HAProxy asks /readyz, and not one call is refused. nginx cannot: calls that reach the server
// that leaves are told so, and the client tries again.
TEST_P(BeforeSeveralServers, OneThatDrainsIsLeftOutAndNoCallFails) {
  server::ServerConfig config = is_haproxy() ? watched_config() : tcp_config();
  config.lame_duck = std::chrono::seconds(is_haproxy() ? 1000 : 0);
  config.drain_grace = std::chrono::seconds(1000);
  start(is_haproxy() ? 2 : 4, config);
  InProcessServer& leaving = *servers_.front();
  client::Client client(proxy_->target());
  leaving.fake().hold();
  auto under_way = std::async(std::launch::async, [&] {
    for (int i = 0; leaving.fake().started() == 0 && i < 100; ++i) {
      client::Client other(proxy_->target());
      expect_smoothed(other, mesh_of_bytes(1000));
    }
  });
  leaving.fake().wait_started(1);

  auto drained = std::async(std::launch::async, [&] { leaving.drain(); });
  if (is_haproxy()) {
    ASSERT_TRUE(eventually([&] { return proxy_->log().find("is DOWN") != std::string::npos; }));
  }
  client::RequestOptions request;
  request.max_attempts = is_haproxy() ? 1 : 40;
  for (int i = 0; i < kTries; ++i) {
    Mesh mesh = mesh_of_bytes(100'000);
    client.smooth(mesh, {}, request);
  }
  EXPECT_EQ(leaving.fake().started(), 1);
  leaving.fake().release();
  under_way.get();  // what it had accepted is answered
  leaving.server().force_shutdown();
  drained.get();
}

TEST_P(BeforeSeveralServers, NoneIsAnErrorThatSaysSo) {
  start(2, is_haproxy() ? watched_config() : tcp_config());
  for (const auto& server : servers_) server->drain();
  client::Client client(proxy_->target());
  for (int i = 0; i < kTries; ++i) {
    Mesh mesh = mesh_of_bytes(2'000'000);
    client::RequestOptions once;
    once.max_attempts = 1;
    const ServiceError error = error_of([&] { client.smooth(mesh, {}, once); });
    EXPECT_EQ(error.code(), client::StatusCode::unavailable) << error.what();
    EXPECT_THAT(error.hint(), HasSubstr("a proxy answers")) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(All, BeforeSeveralServers,
                         ::testing::Values(ProxyKind::haproxy, ProxyKind::nginx),
                         [](const auto& test) { return name_of(test.param); });

// --- wrong configurations -----------------------------------------------------------

struct Trap {
  const char* name;
  ProxyKind kind;
  std::vector<Proxy::Change> changes;
  const char* hint;
};

class WrongConfig : public ::testing::TestWithParam<Trap> {};

TEST_P(WrongConfig, GetsAHint) {
  const Trap& trap = GetParam();
  if (find_program(name_of(trap.kind)).empty()) {
    GTEST_SKIP() << "WARNING: SKIPPED, for " << name_of(trap.kind) << " is not installed";
  }
  InProcessServer server(tcp_config());
  Proxy proxy(trap.kind, {backend(server)}, trap.changes);
  client::Client client(proxy.target());
  server.fake().hold();
  client::RequestOptions request;
  request.timeout = 5s;
  request.max_attempts = 1;
  Mesh mesh = mesh_of_bytes(12'000'000);
  const ServiceError error = error_of([&] { client.smooth(mesh, {}, request); });
  std::cout << error.what() << "; " << error.hint() << "\n";
  EXPECT_EQ(error.reason(), "");
  EXPECT_THAT(error.hint(), HasSubstr(trap.hint)) << error.what();
}

INSTANTIATE_TEST_SUITE_P(
    All, WrongConfig,
    ::testing::Values(
        Trap{"NginxBodyLimit",
             ProxyKind::nginx,
             {{"client_max_body_size 0", "client_max_body_size 1m"}},
             "client_max_body_size"},
        Trap{"NginxReadTimeout",
             ProxyKind::nginx,
             {{"grpc_read_timeout   24h", "grpc_read_timeout 1s"}},
             "grpc_read_timeout"},
        Trap{"NginxTowardsServerHttp1",
             ProxyKind::nginx,
             {{"grpc_pass grpc://", "proxy_pass http://"}},
             "grpc_pass"},
        Trap{"NginxTowardsClientHttp1", ProxyKind::nginx, {{" http2;", ";"}}, "HTTP/2"},
        Trap{"HaproxyServerTimeout",
             ProxyKind::haproxy,
             {{"timeout server 24h", "timeout server 1s"}},
             "timeout server"},
        Trap{"HaproxyTowardsServerHttp1",
             ProxyKind::haproxy,
             {{"default-server proto h2", "default-server"}},
             "HTTP/2"},
        Trap{"HaproxyTowardsClientHttp1",
             ProxyKind::haproxy,
             {{":50051}\" proto h2", ":50051}\" proto h1"}},
             "HTTP/2"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace meshsmooth::testing
