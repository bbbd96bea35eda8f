// What is refused or fails, by which status and reason.
#include <gmock/gmock.h>
#include <grpcpp/impl/client_unary_call.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <stdexcept>

#include "server/raw_call.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"
#include "support/process.hpp"
#include "wire/crc32c.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using namespace std::chrono_literals;

class Refusal : public ::testing::Test {
 protected:
  // The end of a call whose spec was changed.
  void expect_refused(const std::function<void(v1::JobSpec&)>& change, StatusCode code,
                      const std::string& reason, const std::string& field = "") {
    v1::JobSpec spec = TwoTetrahedra::spec();
    change(spec);
    SmoothCall call(stub_);
    call.send(spec);
    EXPECT_EQ(call.finish().error_code(), code) << call.finish().error_message();
    EXPECT_TRUE(call.was_told_to_stop());
    EXPECT_EQ(call.details().reason, reason);
    if (!field.empty()) {
      EXPECT_EQ(call.detail("field"), field);
    }
  }

  // The end of a call that sent these chunks, then half-closed.
  void expect_bad_data(const std::vector<v1::Chunk>& chunks, StatusCode code,
                       const std::string& reason) {
    SmoothCall call(stub_);
    call.send(TwoTetrahedra::spec());
    for (const v1::Chunk& each : chunks) call.send(each);
    call.half_close();
    EXPECT_EQ(call.finish().error_code(), code) << call.finish().error_message();
    EXPECT_EQ(call.details().reason, reason);
    expect_healthy_service(stub_);
  }

  // The end of a job whose smoother throws.
  void expect_failure(const std::function<void()>& thrower, StatusCode code,
                      const std::string& reason) {
    server_.fake().fail_with(thrower);
    SmoothCall call(stub_);
    call.send_all(mesh_);
    EXPECT_EQ(call.finish().error_code(), code);
    EXPECT_EQ(call.details().reason, reason);
    EXPECT_TRUE(call.result().empty());
    server_.fake().fail_with({});
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;

 private:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.max_node_count = 1000;
    config.max_queued_jobs = 2;
    config.max_job_bytes = 100 << 20;
    config.host_memory_limit_bytes = 150 << 20;
    return config;
  }
};

TEST_F(Refusal, OfACallWithoutSpec) {
  SmoothCall empty(stub_);
  empty.half_close();
  EXPECT_EQ(empty.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(empty.details().reason, "SPEC_MISSING");

  SmoothCall chunk_first(stub_);
  chunk_first.send_data(mesh_);
  EXPECT_EQ(chunk_first.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(chunk_first.details().reason, "SPEC_MISSING");
}

TEST_F(Refusal, OfASecondSpec) {
  SmoothCall call(stub_);
  call.send(TwoTetrahedra::spec());
  call.send(TwoTetrahedra::spec());

  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.detail("field"), "spec");
}

TEST_F(Refusal, OfOptionsNamesTheField) {
  expect_refused([](auto& s) { s.mutable_options()->mutable_taubin()->set_lambda(2); },
                 StatusCode::INVALID_ARGUMENT, "OPTION_OUT_OF_RANGE", "taubin.lambda");
  expect_refused(
      [](auto& s) { s.mutable_options()->mutable_optimize()->set_goal(static_cast<v1::Goal>(99)); },
      StatusCode::INVALID_ARGUMENT, "OPTION_NOT_SUPPORTED", "optimize.goal");
  expect_refused([](auto& s) { s.mutable_surface(); }, StatusCode::INVALID_ARGUMENT,
                 "OPTION_OUT_OF_RANGE", "surface.point_count");
  expect_refused([](auto& s) { s.mutable_surface()->set_point_count(9); },
                 StatusCode::INVALID_ARGUMENT, "OPTION_OUT_OF_RANGE", "surface.triangle_count");
  expect_refused([](auto& s) { s.set_request_id("not a UUID"); }, StatusCode::INVALID_ARGUMENT,
                 "OPTION_OUT_OF_RANGE", "request_id");
  expect_refused([](auto& s) { s.set_max_result_chunk_bytes(-1); }, StatusCode::INVALID_ARGUMENT,
                 "OPTION_OUT_OF_RANGE", "max_result_chunk_bytes");
  expect_refused([](auto& s) { s.set_priority(static_cast<v1::Priority>(99)); },
                 StatusCode::INVALID_ARGUMENT, "OPTION_NOT_SUPPORTED", "priority");
  expect_healthy_service(stub_);
}

TEST_F(Refusal, OfArraysThatTheJobHasNoUseForComesBeforeThem) {
  const auto add_surface = [](v1::JobSpec& spec) {
    spec.mutable_surface()->set_point_count(3);
    spec.mutable_surface()->set_triangle_count(1);
  };
  const auto refuse = [&](const std::function<void(v1::JobSpec&)>& change, const char* field) {
    expect_refused(change, StatusCode::INVALID_ARGUMENT, "OPTION_NOT_SUPPORTED", field);
  };
  refuse(add_surface, "surface");  // the boundary is fixed
  refuse(
      [&](v1::JobSpec& spec) {
        add_surface(spec);
        spec.mutable_options()->mutable_taubin();
        spec.mutable_options()->set_boundary_policy(v1::BOUNDARY_POLICY_SLIDE);
      },
      "surface");
  refuse([](v1::JobSpec& spec) { spec.set_prescribed_node_count(1); }, "prescribed_node_count");
  refuse(
      [](v1::JobSpec& spec) {
        spec.mutable_inline_topology()->set_reference_type(v1::SCALAR_TYPE_FLOAT64);
      },
      "inline_topology.reference_type");
  expect_healthy_service(stub_);
}

TEST_F(Refusal, OfBytesThatAreNoMessageSaysSo) {
  for (const std::string method :
       {"GetTopology", "DeleteTopology", "GetJob", "ListJobs", "CancelJob", "DeleteJob",
        "LeaseSharedMemory", "GetServerInfo"}) {
    const std::string path = "/meshsmooth.v1.SmoothingService/" + method;
    const grpc::internal::RpcMethod rpc(path.c_str(), grpc::internal::RpcMethod::NORMAL_RPC);
    const grpc::Slice slice(std::string("\xff\xff\xff"));
    const grpc::ByteBuffer bytes(&slice, 1);
    grpc::ByteBuffer answer;
    grpc::ClientContext context;
    const grpc::Status status =
        grpc::internal::BlockingUnaryCallImpl<grpc::ByteBuffer, grpc::ByteBuffer>(
            server_.channel().get(), rpc, &context, bytes, &answer)
            .status();
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << method;
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr("cannot parse " + method + "Request"));
  }
}

TEST_F(Refusal, OfWhatLaterVersionsWillHave) {
  expect_refused([](auto& s) { s.set_topology_name("topologies/sha256-0"); }, StatusCode::NOT_FOUND,
                 "TOPOLOGY_NOT_FOUND", "");
}

TEST_F(Refusal, OfABackendThatIsNotHere) {
  expect_refused([](auto& s) { s.set_backend_kind(v1::BACKEND_KIND_CUDA); },
                 StatusCode::FAILED_PRECONDITION, "BACKEND_NOT_AVAILABLE", "backend_kind");
}

TEST_F(Refusal, OfAMeshAboveTheLimits) {
  expect_refused([](auto& s) { s.mutable_inline_topology()->set_node_count(1001); },
                 StatusCode::RESOURCE_EXHAUSTED, "MESH_TOO_LARGE");
  expect_refused([](auto& s) { s.mutable_inline_topology()->set_node_count(0); },
                 StatusCode::INVALID_ARGUMENT, "MESH_EMPTY");
}

TEST_F(Refusal, OfAJobThatCouldNeverFitSaysBothNumbersAndAsksForNoRetry) {
  server_.fake().set_estimate({.host_bytes = 200 << 20, .device_bytes = 0});
  SmoothCall call(stub_);
  call.send(TwoTetrahedra::spec());

  EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
  EXPECT_GE(std::stoll(call.detail("need_bytes")), 200 << 20);
  EXPECT_EQ(std::stoll(call.detail("limit_bytes")), 150 << 20);
  EXPECT_FALSE(call.details().retry_delay);
}

TEST_F(Refusal, WhenMemoryIsBusySaysWhenToComeBack) {
  server_.fake().set_estimate({.host_bytes = 80 << 20, .device_bytes = 0});
  SmoothCall first(stub_);
  first.send(TwoTetrahedra::spec());
  first.read_accepted();
  SmoothCall second(stub_);
  second.send(TwoTetrahedra::spec());

  EXPECT_EQ(second.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(second.details().reason, "HOST_MEMORY_BUSY");
  EXPECT_GT(second.details().retry_delay.value_or(0s), 0s);

  first.send_data(mesh_);
  EXPECT_TRUE(first.finish().ok());
  expect_healthy_service(stub_);
}

TEST_F(Refusal, WhenTheQueueIsFullSaysWhenToComeBack) {
  server_.fake().hold();
  SmoothCall running(stub_);
  running.send_all(mesh_);
  server_.fake().wait_started(1);
  SmoothCall second(stub_), third(stub_), fourth(stub_);
  second.send_all(mesh_);
  second.read_accepted();
  third.send_all(mesh_);
  third.read_accepted();
  // A job is accepted before its mesh is there; then it takes its place in the queue.
  ASSERT_TRUE(eventually([&] {
    const v1::ListJobsResponse jobs = list_jobs(stub_);
    return std::count_if(jobs.jobs().begin(), jobs.jobs().end(),
                         [](const v1::Job& job) { return job.state() == v1::STATE_QUEUED; }) == 2;
  }));
  fourth.send(TwoTetrahedra::spec());

  EXPECT_EQ(fourth.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(fourth.details().reason, "QUEUE_FULL");
  EXPECT_GT(fourth.details().retry_delay.value_or(0s), 0s);

  server_.fake().release();
  EXPECT_TRUE(running.finish().ok());
  EXPECT_TRUE(second.finish().ok());
  EXPECT_TRUE(third.finish().ok());
  expect_healthy_service(stub_);
}

TEST_F(Refusal, ReachesAClientThatGoesOnSending) {
  SmoothCall call(stub_);
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->set_node_count(1001);
  call.send(spec);
  for (int i = 0; i < 200; ++i) {
    if (!call.send(chunk(v1::ARRAY_ID_ELEMENTS, i * 100'000, std::string(100'000, 'x')))) break;
  }

  EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
}

TEST_F(Refusal, OfChunksOutOfOrder) {
  expect_bad_data({chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh_.coordinates))},
                  StatusCode::INVALID_ARGUMENT, "CHUNK_OUT_OF_ORDER");
  expect_bad_data({chunk(v1::ARRAY_ID_ELEMENTS, 4, "1234")}, StatusCode::INVALID_ARGUMENT,
                  "CHUNK_OUT_OF_ORDER");
}

TEST_F(Refusal, OfTooFewBytes) {
  expect_bad_data({}, StatusCode::INVALID_ARGUMENT, "ARRAY_SIZE_MISMATCH");
  expect_bad_data({chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements)}, StatusCode::INVALID_ARGUMENT,
                  "ARRAY_SIZE_MISMATCH");
}

TEST_F(Refusal, OfTooManyBytes) {
  expect_bad_data({chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements + "1234")},
                  StatusCode::INVALID_ARGUMENT, "ARRAY_SIZE_MISMATCH");
}

TEST_F(Refusal, OfBytesAfterACompleteMeshStopsTheJob) {
  server_.fake().hold();
  SmoothCall call(stub_);
  call.send(TwoTetrahedra::spec());
  const std::string name = call.read_accepted();
  call.send_data(mesh_);
  server_.fake().wait_started(1);
  call.send(chunk(v1::ARRAY_ID_COORDINATES, 120, "1234"));

  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.details().reason, "ARRAY_SIZE_MISMATCH");
  wait_for_state(stub_, name, v1::STATE_FAILED);
  server_.fake().release();
  expect_healthy_service(stub_);
}

TEST_F(Refusal, OfAWrongChecksumIsDataLoss) {
  v1::Chunk bad = chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements);
  bad.set_crc32c(12345);
  expect_bad_data({bad}, StatusCode::DATA_LOSS, "CHECKSUM_MISMATCH");
}

TEST_F(Refusal, ComesWithoutHalfCloseOnceTheClientHadItsTime) {
  server::ServerConfig config = quiet_config();
  config.drop_timeout = std::chrono::milliseconds(500);
  InProcessServer server(config);
  Stub stub(server.channel());
  SmoothCall call(stub);
  call.send(v1::JobSpec());

  const auto response = call.read();
  ASSERT_TRUE(response && response->has_stop_sending());

  EXPECT_FALSE(call.read());  // the stream ends though the client did not
  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
}

TEST_F(Refusal, OfAnUploadThatPausesTooLong) {
  server::ServerConfig config = quiet_config();
  config.stream_idle_timeout = std::chrono::milliseconds(500);
  InProcessServer server(config);
  Stub stub(server.channel());
  SmoothCall call(stub);
  call.send(TwoTetrahedra::spec());

  EXPECT_EQ(call.finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(call.details().reason, "STREAM_IDLE");
  expect_nothing_reserved(stub);
}

TEST_F(Refusal, OfAClientThatDoesNotReadItsResult) {
  server::ServerConfig config = quiet_config();
  config.stream_idle_timeout = std::chrono::milliseconds(500);
  InProcessServer server(config);
  Stub stub(server.channel());
  SmoothCall call(stub);
  call.send(TwoTetrahedra::spec());
  const std::string name = call.read_accepted();
  call.send_data(mesh_);

  const v1::Job job = wait_for_state(stub, name, v1::STATE_FAILED);

  EXPECT_EQ(job.error().reason(), "STREAM_IDLE");
  expect_nothing_reserved(stub);
}

TEST_F(Refusal, OfJobsThatTheSmootherRefusesKeepsReasonAndElement) {
  expect_failure(
      [] {
        throw InvalidMesh("INDEX_OUT_OF_RANGE", "element 1: node 9 is not below 5",
                          {{"element", "1"}});
      },
      StatusCode::INVALID_ARGUMENT, "INDEX_OUT_OF_RANGE");
  expect_failure([] { throw OutOfMemory("HOST_MEMORY_EXHAUSTED", "no memory"); },
                 StatusCode::RESOURCE_EXHAUSTED, "HOST_MEMORY_EXHAUSTED");
  expect_healthy_service(stub_);
}

TEST_F(Refusal, HidesTheTextOfUnforeseenErrors) {
  server_.fake().fail_with([] { throw std::runtime_error("secret path"); });
  SmoothCall call(stub_);
  call.send_all(mesh_);

  EXPECT_EQ(call.finish().error_code(), StatusCode::INTERNAL);
  EXPECT_EQ(call.details().reason, "INTERNAL");
  EXPECT_THAT(call.finish().error_message(), ::testing::Not(::testing::HasSubstr("secret")));
  EXPECT_THAT(call.detail("incident"), ::testing::StartsWith("jobs/"));
}

TEST_F(Refusal, AfterALostDeviceTurnsHealthRed) {
  RawCall watch(server_.channel(), "/grpc.health.v1.Health/Watch");
  watch.send(string_message(1, ""));
  ASSERT_EQ(watch.read(), "\x08\x01");  // SERVING

  expect_failure([] { throw DeviceError("DEVICE_LOST", "the device fell off the bus", true); },
                 StatusCode::UNAVAILABLE, "DEVICE_LOST");

  EXPECT_EQ(watch.read(), "\x08\x02");  // NOT_SERVING
  EXPECT_FALSE(server_info(stub_).backends(0).healthy());
  EXPECT_TRUE(server_.server().device_lost());
}

TEST_F(Refusal, AfterALostDeviceCallsForAnotherProcess) {
  const auto fake = std::make_shared<FakeControl>();
  fake->fail_with([] { throw DeviceError("DEVICE_LOST", "the device fell off the bus", true); });
  std::promise<void> called;
  server::Server server(quiet_config(), [=] { return std::make_unique<FakeSmoother>(fake); });
  server.start([&] { called.set_value(); });
  EXPECT_FALSE(server.device_lost());
  Stub stub(server.in_process_channel());
  SmoothCall call(stub);
  call.send_all(mesh_);
  call.finish();

  EXPECT_EQ(called.get_future().wait_for(60s), std::future_status::ready);
  EXPECT_TRUE(server.device_lost());
}

}  // namespace
}  // namespace meshsmooth::testing
