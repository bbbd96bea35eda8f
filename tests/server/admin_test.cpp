// What is seen from outside: /metrics equals what the callers saw (R18), /healthz and
// /readyz follow the server's life (R19).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "server/smooth_call.hpp"
#include "support/http.hpp"
#include "support/http2_peer.hpp"
#include "support/in_process_server.hpp"
#include "support/process.hpp"

namespace meshsmooth::testing {
namespace {

using Metrics = std::map<std::string, double>;

server::ServerConfig admin_config() {
  server::ServerConfig config = quiet_config();
  config.admin_listen = "127.0.0.1:0";
  return config;
}

Metrics scrape(InProcessServer& server) {
  const HttpResponse response = http_get(server.server().admin_port(), "/metrics");
  EXPECT_EQ(response.status, 200);
  return parse_metrics(response.text);
}

/// Once so many calls are under way: a caller has its answer before the server is done with the
/// call.
Metrics scrape_with_streams(InProcessServer& server, int count) {
  Metrics metrics;
  EXPECT_TRUE(eventually([&] {
    metrics = scrape(server);
    return metrics.at("meshsmooth_streams") == count;
  })) << metrics.at("meshsmooth_streams");
  return metrics;
}

int status_of(InProcessServer& server, const std::string& page) {
  return http_get(server.server().admin_port(), page).status;
}

/// What one caller of many noticed.
struct Observed {
  Metrics jobs;  // by the name that /metrics gives them
  double uploaded_bytes = 0;
  double downloaded_bytes = 0;

  void count(const std::string& outcome, const std::string& reason) {
    ++jobs["meshsmooth_jobs_total{outcome=\"" + outcome + "\",reason=\"" + reason + "\"}"];
  }
  void count(SmoothCall& call, const std::string& outcome) {
    call.finish();
    count(outcome, call.details().reason);
    downloaded_bytes += static_cast<double>(call.result().size());
  }
};

double size_of(const TwoTetrahedra& mesh) {
  return static_cast<double>(mesh.elements.size() + mesh.fixed.size() +
                             mesh.coordinates.size() * sizeof(double));
}

TEST(Admin, CountsWhatTheCallersSaw) {
  server::ServerConfig config = admin_config();
  config.max_queued_jobs = 1;
  InProcessServer server(config);
  Stub stub(server.channel());
  const TwoTetrahedra mesh;
  Observed seen;
  const auto send = [&](SmoothCall& call) {
    call.send_all(mesh);
    seen.uploaded_bytes += size_of(mesh);
  };

  for (int i = 0; i < 7; ++i) {  // they succeed
    SmoothCall call(stub);
    send(call);
    seen.count(call, "succeeded");
  }

  server.fake().fail_with([] { throw InvalidMesh("REPEATED_NODE", "a test"); });
  for (int i = 0; i < 3; ++i) {  // fail in the lane, with a reason
    SmoothCall call(stub);
    send(call);
    seen.count(call, "failed");
  }
  server.fake().fail_with([] { throw std::runtime_error("a bug"); });
  {
    SmoothCall call(stub);
    send(call);
    seen.count(call, "failed");
  }
  server.fake().fail_with({});
  {  // fails while it is received
    SmoothCall call(stub);
    call.send(TwoTetrahedra::spec());
    call.read_accepted();
    call.send(chunk(v1::ARRAY_ID_COORDINATES, 8, "12345678"));
    seen.count(call, "failed");
  }

  for (int i = 0; i < 2; ++i) {  // refused for what they ask
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_request_id("not a UUID");
    SmoothCall call(stub);
    call.send(spec);
    seen.count(call, "refused");
  }
  {
    SmoothCall call(stub);
    call.half_close();
    seen.count(call, "refused");
  }

  server.fake().hold();
  SmoothCall running(stub), queued(stub), receiving(stub), refused(stub);
  send(running);
  const std::string running_name = running.read_accepted();
  server.fake().wait_started(12);
  receiving.send(TwoTetrahedra::spec());  // takes no place in the queue
  receiving.read_accepted();
  send(queued);
  const std::string queued_name = queued.read_accepted();
  wait_for_state(stub, queued_name, v1::STATE_QUEUED);
  refused.send(TwoTetrahedra::spec());  // the queue is full
  seen.count(refused, "refused");

  const Metrics busy = scrape_with_streams(server, 3);
  EXPECT_EQ(busy.at("meshsmooth_jobs{state=\"running\"}"), 1);
  EXPECT_EQ(busy.at("meshsmooth_jobs{state=\"queued\"}"), 1);
  EXPECT_EQ(busy.at("meshsmooth_jobs{state=\"receiving\"}"), 1);
  EXPECT_EQ(busy.at("meshsmooth_queue_depth{priority=\"normal\"}"), 1);
  EXPECT_EQ(busy.at("meshsmooth_queue_depth{priority=\"batch\"}"), 0);
  EXPECT_GT(busy.at("meshsmooth_queue_oldest_seconds"), 0);
  EXPECT_EQ(busy.at("meshsmooth_reserved_bytes{space=\"host\"}"),
            static_cast<double>(server_info(stub).backends(0).reserved_bytes()));
  EXPECT_GT(busy.at("meshsmooth_lane_busy_seconds_total{device=\"cpu\",lane=\"0\"}"), 0);

  receiving.cancel();  // by the client, who sees no reason
  receiving.finish();
  seen.count("cancelled", "CANCELLED_BY_CLIENT");
  grpc::ClientContext context;
  v1::CancelJobRequest request;
  request.set_name(queued_name);
  v1::CancelJobResponse response;
  EXPECT_TRUE(stub.CancelJob(&context, request, &response).ok());
  seen.count(queued, "cancelled");
  server.fake().release();
  seen.count(running, "succeeded");
  expect_nothing_reserved(stub);

  Metrics counted;
  const Metrics now = scrape_with_streams(server, 0);
  for (const auto& [name, value] : now) {
    if (name.starts_with("meshsmooth_jobs_total")) counted[name] = value;
  }
  EXPECT_EQ(counted, seen.jobs);
  EXPECT_EQ(now.at("meshsmooth_received_bytes_total"), seen.uploaded_bytes);
  EXPECT_EQ(now.at("meshsmooth_sent_bytes_total"), seen.downloaded_bytes);
  EXPECT_EQ(now.at("meshsmooth_nodes_total"), 8 * 5);
  EXPECT_EQ(now.at("meshsmooth_queue_wait_seconds_count"), server.fake().started());
  EXPECT_EQ(now.at("meshsmooth_job_seconds_count"), 8);
  EXPECT_EQ(now.at("meshsmooth_stage_seconds_count{stage=\"iterate\"}"), 8);
  EXPECT_EQ(now.at("meshsmooth_reserved_bytes{space=\"host\"}"), 0);
}

TEST(Admin, AnswersNothingElse) {
  InProcessServer server(admin_config());
  const int port = server.server().admin_port();

  EXPECT_EQ(http_get(port, "/").status, 404);
  EXPECT_EQ(http_get(port, "/metrics/more").status, 404);
  EXPECT_EQ(http_get(port, "/../../etc/passwd").status, 404);
  EXPECT_EQ(http_get(port, "/metrics", "POST").status, 405);
  EXPECT_EQ(http_get(port, "/metrics", "DELETE").status, 405);
  EXPECT_EQ(http_get(port, "/metrics", "HEAD").text, "");
}

TEST(Admin, IsOffUnlessAskedFor) {
  InProcessServer server;
  EXPECT_EQ(server.server().admin_port(), 0);
}

TEST(Admin, NamesAnAddressThatCannotBeBound) {
  InProcessServer first(admin_config());
  server::ServerConfig config = quiet_config();
  config.admin_listen = "127.0.0.1:" + std::to_string(first.server().admin_port());
  try {
    InProcessServer second(config);
    FAIL();
  } catch (const InvalidOption& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("admin-listen"));
  }
}

TEST(Probes, FollowStartServingAndDrain) {
  server::ServerConfig config = admin_config();
  {  // a port that is free, as the server says its own only once it serves
    InProcessServer other(admin_config());
    config.admin_listen = "127.0.0.1:" + std::to_string(other.server().admin_port());
  }
  const int port = std::stoi(config.admin_listen.substr(config.admin_listen.rfind(':') + 1));
  config.lame_duck = std::chrono::seconds(1000);
  std::promise<void> warm;
  const auto fake = std::make_shared<FakeControl>();
  server::Server server(config, [&] {
    warm.get_future().wait();
    return std::make_unique<FakeSmoother>(fake);
  });
  const auto started = std::async(std::launch::async, [&] { server.start(); });
  while (http_get(port, "/readyz").status == 0) std::this_thread::yield();

  EXPECT_EQ(http_get(port, "/readyz").status, 503);
  EXPECT_EQ(http_get(port, "/readyz").text, "starting\n");
  EXPECT_EQ(http_get(port, "/healthz").status, 200);
  EXPECT_EQ(http_get(port, "/metrics").status, 200);

  warm.set_value();
  started.wait();
  EXPECT_EQ(http_get(port, "/readyz").status, 200);
  EXPECT_EQ(http_get(port, "/healthz").status, 200);

  const auto drained = std::async(std::launch::async, [&] { server.drain(); });
  while (http_get(port, "/readyz").status == 200) std::this_thread::yield();
  EXPECT_EQ(http_get(port, "/readyz").text, "draining\n");
  EXPECT_EQ(http_get(port, "/healthz").status, 200);
  server.force_shutdown();
}

TEST(Probes, FailOnceTheDeviceIsLost) {
  InProcessServer server(admin_config());
  Stub stub(server.channel());
  server.fake().fail_with([] { throw DeviceError("DEVICE_LOST", "gone", true); });
  SmoothCall call(stub);
  call.send_all({});
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE);

  while (status_of(server, "/healthz") == 200) std::this_thread::yield();
  EXPECT_EQ(status_of(server, "/healthz"), 503);
  EXPECT_EQ(status_of(server, "/readyz"), 503);
  EXPECT_EQ(scrape(server).at("meshsmooth_lanes{state=\"working\"}"), 0);
  EXPECT_EQ(scrape(server).at("meshsmooth_lanes{state=\"broken\"}"), 1);
}

/// Connections to the admin port that have sent a part of a request, or the whole of one whose
/// answer they do not read.
std::vector<std::unique_ptr<Peer>> slow_clients(int port, int count, const std::string& sent) {
  std::vector<std::unique_ptr<Peer>> clients;
  for (int i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<Peer>(port));
    clients.back()->send(sent);
  }
  return clients;
}

TEST(Admin, SlowClientsDelayNoProbe) {
  InProcessServer server(admin_config());
  const int port = server.server().admin_port();
  for (const char* sent : {"G", "GET /healthz HTTP/1.1\r\nX: ", "GET /metrics HTTP/1.1\r\n\r\n",
                           "GET /readyz HTTP/1.1\r\n\r\n"}) {
    const auto clients = slow_clients(port, 200, sent);
    for (const char* page : {"/healthz", "/readyz", "/metrics"}) {
      const auto begin = std::chrono::steady_clock::now();
      EXPECT_EQ(status_of(server, page), 200);
      EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1)) << sent;
    }
  }
}

TEST(Admin, MoreClientsThanItHoldsGiveWay) {
  InProcessServer server(admin_config());
  const auto clients = slow_clients(server.server().admin_port(), 700, "GET /");
  EXPECT_EQ(status_of(server, "/healthz"), 200);
}

TEST(Admin, RefusesWhatIsNoRequest) {
  InProcessServer server(admin_config());
  for (const std::string& sent :
       {std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), std::string("\r\n\r\n"),
        std::string("GET\r\n\r\n"), "GET /" + std::string(10'000, 'x')}) {
    Peer peer(server.server().admin_port());
    peer.send(sent);
    EXPECT_THAT(peer.read_all(), ::testing::StartsWith("HTTP/1.1 400 "));
  }
}

}  // namespace
}  // namespace meshsmooth::testing
