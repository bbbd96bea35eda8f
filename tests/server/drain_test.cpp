// How a server leaves, as health and jobs see it.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "server/raw_call.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;

// HealthCheckResponse { status = 1 }
constexpr const char* kServing = "\x08\x01";
constexpr const char* kNotServing = "\x08\x02";

// Over TCP: an in-process channel closes with the server and takes along what
// the client has not read yet.
server::ServerConfig tcp_config() {
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  return config;
}

std::shared_ptr<grpc::Channel> connect(InProcessServer& server) {
  return grpc::CreateChannel("127.0.0.1:" + std::to_string(server.server().port()),
                             grpc::InsecureChannelCredentials());
}

server::ServerConfig patient_config() {
  server::ServerConfig config = tcp_config();
  config.lame_duck = std::chrono::seconds(1000);
  config.drain_grace = std::chrono::seconds(1000);
  return config;
}

std::future<void> drain(InProcessServer& server) {
  return std::async(std::launch::async, [&server] { server.drain(); });
}

TEST(Health, AnswersCheckForServerAndService) {
  InProcessServer server(tcp_config());
  for (const std::string& name : {std::string(), std::string("meshsmooth.v1.SmoothingService")}) {
    RawCall call(connect(server), "/grpc.health.v1.Health/Check");
    call.send(string_message(1, name));
    EXPECT_EQ(call.read(), kServing) << name;
  }
}

TEST(Health, IsNotServingFromTheFirstMomentOfADrain) {
  InProcessServer server(patient_config());
  Stub stub(connect(server));
  RawCall watch(connect(server), "/grpc.health.v1.Health/Watch");
  watch.send(string_message(1, "meshsmooth.v1.SmoothingService"));
  ASSERT_EQ(watch.read(), kServing);

  const auto drained = drain(server);

  EXPECT_EQ(watch.read(), kNotServing);
  expect_healthy_service(stub);  // the lame duck still accepts
  server.server().force_shutdown();
}

TEST(Drain, RefusesNewJobsWithAWordWhenToComeBack) {
  server::ServerConfig config = patient_config();
  config.lame_duck = std::chrono::seconds(0);
  InProcessServer server(config);
  Stub stub(connect(server));
  server.fake().hold();
  SmoothCall running(stub);
  running.send_all({});
  server.fake().wait_started(1);
  const auto drained = drain(server);
  while (!server_info(stub).draining()) std::this_thread::yield();

  SmoothCall late(stub);
  late.send(TwoTetrahedra::spec());

  EXPECT_EQ(late.finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(late.details().reason, "DRAINING");
  EXPECT_EQ(late.details().retry_delay, std::chrono::nanoseconds(0));

  server.fake().release();
  EXPECT_TRUE(running.finish().ok());
  drained.wait();
}

TEST(Drain, RejectsWaitingJobsAndLetsTheRunningOneFinish) {
  server::ServerConfig config = patient_config();
  config.lame_duck = std::chrono::seconds(0);
  InProcessServer server(config);
  Stub stub(connect(server));
  server.fake().hold();
  const TwoTetrahedra mesh;
  SmoothCall running(stub), queued(stub), receiving(stub);
  running.send_all(mesh);
  server.fake().wait_started(1);
  queued.send_all(mesh);
  wait_for_state(stub, queued.read_accepted(), v1::STATE_QUEUED);
  receiving.send(TwoTetrahedra::spec());
  receiving.read_accepted();

  const auto drained = drain(server);

  EXPECT_EQ(queued.finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(queued.details().reason, "DRAINING");
  EXPECT_EQ(receiving.finish().error_code(), StatusCode::UNAVAILABLE);
  server.fake().release();
  EXPECT_TRUE(running.finish().ok());
  EXPECT_EQ(running.result(), mesh.moved());
  drained.wait();
}

TEST(Drain, StopsRunningJobsAfterTheGrace) {
  server::ServerConfig config = tcp_config();
  config.drain_grace = std::chrono::milliseconds(10);
  InProcessServer server(config);
  Stub stub(connect(server));
  server.fake().hold();
  SmoothCall running(stub);
  running.send_all({});
  server.fake().wait_started(1);

  const auto drained = drain(server);

  EXPECT_EQ(running.finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(running.details().reason, "DRAINING");
  drained.wait();
}

TEST(Drain, EndsAtOnceWhenForced) {
  InProcessServer server(patient_config());
  Stub stub(connect(server));
  server.fake().hold();
  SmoothCall running(stub);
  running.send_all({});
  server.fake().wait_started(1);
  const auto drained = drain(server);

  server.server().force_shutdown();

  EXPECT_EQ(running.finish().error_code(), StatusCode::UNAVAILABLE);
  drained.wait();
}

server::ServerConfig impatient_config() {
  server::ServerConfig config = tcp_config();
  config.drop_timeout = std::chrono::milliseconds(500);
  return config;
}

TEST(Drain, EndsThoughAClientNeverHalfCloses) {
  InProcessServer server(impatient_config());
  Stub stub(connect(server));
  SmoothCall stuck(stub);
  stuck.send(TwoTetrahedra::spec());
  stuck.read_accepted();
  const auto drained = drain(server);

  const auto response = stuck.read();
  ASSERT_TRUE(response && response->has_stop_sending());

  EXPECT_FALSE(stuck.read());
  EXPECT_EQ(stuck.finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(stuck.details().reason, "DRAINING");
  drained.wait();
}

TEST(Drain, EndsThoughAClientNeverReads) {
  InProcessServer server(impatient_config());
  Stub stub(connect(server));
  SmoothCall stuck(stub);
  stuck.send(TwoTetrahedra::spec());
  stuck.read_accepted();

  server.drain();

  EXPECT_FALSE(stuck.finish().ok());
}

}  // namespace
}  // namespace meshsmooth::testing
