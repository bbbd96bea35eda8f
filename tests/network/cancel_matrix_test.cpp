// Every way to end a job in every state that it can be in, directly and behind proxies.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <optional>

#include "network/proxy.hpp"
#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/growing_time.hpp"
#include "support/in_process_server.hpp"
#include "support/relay.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

enum class Way { client, deadline, job_call, lost_client, drain };

struct Case {
  v1::State state;
  Way way;
  std::optional<ProxyKind> proxy;
};

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  static const std::map<Way, std::string> kWays = {{Way::client, "Client"},
                                                   {Way::deadline, "Deadline"},
                                                   {Way::job_call, "JobCall"},
                                                   {Way::lost_client, "LostClient"},
                                                   {Way::drain, "Drain"}};
  return v1::State_Name(info.param.state).substr(6) + "_by_" + kWays.at(info.param.way) +
         (info.param.proxy ? "_behind_" + name_of(*info.param.proxy) : "");
}

class CancelMatrix : public ::testing::TestWithParam<Case> {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.listen = "127.0.0.1:0";
    config.drop_timeout = std::chrono::seconds(1);  // nobody reads while the server drains
    return config;
  }

  /// Leads a job into the state, from which it does not go by itself; nothing when its
  /// deadline comes first.
  std::optional<std::string> lead(SmoothCall& call, v1::State state) {
    std::optional<std::string> name;
    if (state == v1::STATE_RECEIVING) {
      call.send(TwoTetrahedra::spec());
      name = call.try_read_accepted();
    } else if (state == v1::STATE_SENDING) {
      // More than the windows take, and nobody reads it.
      constexpr std::int64_t kNodes = 1 << 20;
      v1::JobSpec spec = TwoTetrahedra::spec();
      spec.mutable_inline_topology()->set_node_count(kNodes);
      spec.mutable_inline_topology()->set_fixed_mask_present(false);
      call.send(spec);
      name = call.try_read_accepted();
      call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements));
      for (std::int64_t i = 0; i < 24; ++i) {
        call.send(chunk(v1::ARRAY_ID_COORDINATES, i << 20, std::string(1 << 20, '\0')));
      }
    } else {
      call.send_all(mesh_);
      name = call.try_read_accepted();
    }
    if (name && wait_for_state_or_end(stub_, *name, state).state() != state) name.reset();
    return name;
  }

  /// So that a job stays in that state.
  void hold_in(v1::State state) {
    if (state != v1::STATE_RUNNING && state != v1::STATE_QUEUED) return;
    server_.fake().hold();
    if (state == v1::STATE_RUNNING) return;
    first_.send_all(mesh_);
    wait_for_state(stub_, first_.read_accepted(), v1::STATE_RUNNING);
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
  SmoothCall first_{stub_};
  TwoTetrahedra mesh_;
};

TEST_P(CancelMatrix, EndsTheJobAndGivesAllBack) {
  const auto [state, way, proxy_kind] = GetParam();
  std::unique_ptr<Proxy> proxy;
  int port = server_.server().port();
  if (proxy_kind) {
    if (find_program(name_of(*proxy_kind)).empty()) {
      GTEST_SKIP() << "WARNING: SKIPPED, for " << name_of(*proxy_kind) << " is not installed";
    }
    proxy = std::make_unique<Proxy>(*proxy_kind, std::vector<Proxy::Backend>{{port}});
    port = proxy->port();
  }
  Relay relay(port);
  Stub far_stub(grpc::CreateChannel(relay.target(), grpc::InsecureChannelCredentials()));
  server_info(far_stub);  // connected
  Conservation conservation(stub_);
  hold_in(state);
  std::optional<std::chrono::system_clock::time_point> deadline;
  std::optional<SmoothCall> led;
  std::string name;
  test::with_growing_time([&, state = state, way = way](auto time) {
    if (way == Way::deadline) deadline = std::chrono::system_clock::now() + time;
    led.emplace(far_stub, deadline);
    const auto found = lead(*led, state);
    name = found.value_or("");
    return found.has_value();
  });
  ASSERT_FALSE(name.empty());
  SmoothCall& call = *led;

  auto start = Clock::now();
  std::thread drainer;
  switch (way) {
    case Way::client:
      call.cancel();
      break;
    case Way::deadline:
      std::this_thread::sleep_until(*deadline);
      start = Clock::now();
      break;
    case Way::job_call: {
      grpc::ClientContext context;
      v1::CancelJobRequest request;
      request.set_name(name);
      v1::CancelJobResponse response;
      EXPECT_TRUE(stub_.CancelJob(&context, request, &response).ok());
      break;
    }
    case Way::lost_client:
      relay.cut();
      break;
    case Way::drain:
      server_.server().force_shutdown();
      drainer = std::thread([this] { server_.drain(); });
      break;
  }
  if (way == Way::drain) {
    drainer.join();  // all calls and jobs have ended, else it would not come back
    EXPECT_FALSE(call.finish().ok());
    return;
  }
  v1::Job job;
  do {
    job = get_job(stub_, name);
  } while (job.state() < v1::STATE_SUCCEEDED);
  const double milliseconds =
      std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  RecordProperty("milliseconds", std::to_string(milliseconds));
  std::cout << "ended after " << milliseconds << " ms\n";
  EXPECT_TRUE(job.state() == v1::STATE_CANCELLED || job.state() == v1::STATE_FAILED);
  EXPECT_NE(job.error().reason(), "INTERNAL");

  call.cancel();
  call.finish();
  server_.fake().release();
  if (state == v1::STATE_QUEUED) {
    EXPECT_TRUE(first_.finish().ok());  // the other job is as it was
    EXPECT_EQ(first_.result(), mesh_.moved());
  }
  conservation.check();
  expect_healthy_service(stub_);
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const v1::State state :
       {v1::STATE_RECEIVING, v1::STATE_QUEUED, v1::STATE_RUNNING, v1::STATE_SENDING}) {
    for (const Way way :
         {Way::client, Way::deadline, Way::job_call, Way::lost_client, Way::drain}) {
      cases.push_back({state, way, {}});
      cases.push_back({state, way, ProxyKind::haproxy});
      cases.push_back({state, way, ProxyKind::nginx});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(All, CancelMatrix, ::testing::ValuesIn(all_cases()), name_of);

// --- a client that does not read ---------------------------------------------------

// It holds the positions that it does not take, not the mesh and not what the run needed.
TEST(UnreadResult, CostsItsPositionsAndAStream) {
  InProcessServer server;
  Stub stub(server.channel());
  Conservation conservation(stub);
  server.fake().set_estimate({.host_bytes = 200 << 20, .device_bytes = 0});
  constexpr std::int64_t kNodes = 1 << 19, kElements = 1 << 20;
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->set_node_count(kNodes);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(kElements);
  {
    SmoothCall call(stub);
    call.send(spec);
    const std::string name = call.read_accepted();
    EXPECT_GT(server_info(stub).backends(0).reserved_bytes(), (200 << 20) + 16 * kElements);
    for (std::int64_t i = 0; i < 16; ++i) {
      call.send(chunk(v1::ARRAY_ID_ELEMENTS, i << 20, std::string(1 << 20, '\0')));
    }
    for (std::int64_t i = 0; i < 12; ++i) {
      call.send(chunk(v1::ARRAY_ID_COORDINATES, i << 20, std::string(1 << 20, '\0')));
    }
    wait_for_state(stub, name, v1::STATE_SENDING);

    // The window that gRPC grows by itself, and two messages.
    constexpr std::int64_t kStream = (8 << 20) + 2 * (4 << 20);
    const auto limit = Clock::now() + 20s;
    while (server_info(stub).backends(0).reserved_bytes() > 24 * kNodes + kStream &&
           Clock::now() < limit) {
    }
    EXPECT_EQ(server_info(stub).backends(0).reserved_bytes(), 24 * kNodes + kStream);
    server.fake().set_estimate({});
    const TwoTetrahedra mesh;
    SmoothCall other(stub);
    other.send_all(mesh);
    EXPECT_TRUE(other.finish().ok());  // others go on
  }
  conservation.check();
}

}  // namespace
}  // namespace meshsmooth::testing
