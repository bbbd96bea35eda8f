// Jobs that are ended before their time: by the client, by its deadline, by
// CancelJob, by the queue; in each state.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include "server/smooth_call.hpp"
#include "support/growing_time.hpp"
#include "support/in_process_server.hpp"
#include "support/relay.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using namespace std::chrono_literals;

class Cancel : public ::testing::Test {
 protected:
  // A job in each state; the fake holds.
  std::string receive(SmoothCall& call) {
    call.send(TwoTetrahedra::spec());
    return call.read_accepted();
  }
  std::string run(SmoothCall& call) {
    server_.fake().hold();
    call.send_all(mesh_);
    const std::string name = call.read_accepted();
    server_.fake().wait_started(1);
    return name;
  }
  std::string queue(SmoothCall& call, const v1::JobSpec& spec = TwoTetrahedra::spec()) {
    call.send_all(mesh_, spec);
    const std::string name = call.read_accepted();
    wait_for_state(stub_, name, v1::STATE_QUEUED);
    return name;
  }

  grpc::Status cancel_job(const std::string& name, bool result_kept = false) {
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_name(name);
    request.set_result_kept(result_kept);
    v1::CancelJobResponse response;
    return stub_.CancelJob(&context, request, &response);
  }

  void expect_cancelled(const std::string& name, const std::string& reason) {
    const v1::Job job = wait_for_state(stub_, name, v1::STATE_CANCELLED);
    EXPECT_EQ(job.error().reason(), reason);
    EXPECT_TRUE(job.has_end_time());
  }

  void TearDown() override {
    server_.fake().release();
    expect_healthy_service(stub_);
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
};

TEST_F(Cancel, ByTheClientWhileReceiving) {
  SmoothCall call(stub_);
  const std::string name = receive(call);
  call.cancel();

  expect_cancelled(name, "CANCELLED_BY_CLIENT");
}

TEST_F(Cancel, ByTheClientWhileQueued) {
  SmoothCall first(stub_), second(stub_);
  run(first);
  const std::string name = queue(second);
  second.cancel();

  expect_cancelled(name, "CANCELLED_BY_CLIENT");
  EXPECT_EQ(server_.fake().started(), 1);
}

TEST_F(Cancel, ByTheClientWhileRunning) {
  SmoothCall call(stub_);
  const std::string name = run(call);
  call.cancel();

  expect_cancelled(name, "CANCELLED_BY_CLIENT");
}

TEST_F(Cancel, ByTheClientWhileSending) {
  // The client reads nothing, so that the result does not fit the transport.
  constexpr std::int64_t kNodes = 1 << 20;
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->set_node_count(kNodes);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  SmoothCall call(stub_);
  call.send(spec);
  const std::string name = call.read_accepted();
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements));
  for (std::int64_t i = 0; i < 24; ++i) {
    call.send(chunk(v1::ARRAY_ID_COORDINATES, i << 20, std::string(1 << 20, '\0')));
  }
  wait_for_state(stub_, name, v1::STATE_SENDING);
  call.cancel();

  expect_cancelled(name, "CANCELLED_BY_CLIENT");
}

TEST_F(Cancel, ByTheDeadlineWhileRunning) {
  server_.fake().hold();
  test::with_growing_time([this](auto time) {
    SmoothCall call(stub_, std::chrono::system_clock::now() + time);
    call.send_all(mesh_);
    const auto name = call.try_read_accepted();

    EXPECT_EQ(call.finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
    if (!name) return false;
    const v1::Job job = wait_for_state(stub_, *name, v1::STATE_FAILED);
    if (job.error().reason() == "DEADLINE_RUNNING") return true;
    EXPECT_EQ(job.error().reason(), "DEADLINE_IN_QUEUE");
    return false;
  });
}

TEST_F(Cancel, ByTheDeadlineWhileQueued) {
  SmoothCall first(stub_);
  run(first);
  test::with_growing_time([this](auto time) {
    SmoothCall second(stub_, std::chrono::system_clock::now() + time);
    second.send_all(mesh_);
    const auto name = second.try_read_accepted();
    const bool queued =
        name && (wait_for_state_or_end(stub_, *name, v1::STATE_QUEUED).state() == v1::STATE_QUEUED);

    EXPECT_EQ(second.finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
    if (!name) return false;
    const v1::Job job = wait_for_state(stub_, *name, v1::STATE_FAILED);
    EXPECT_EQ(job.error().reason(), "DEADLINE_IN_QUEUE");
    EXPECT_EQ(server_.fake().started(), 1);
    return queued;
  });
}

TEST_F(Cancel, ByTheQueueTimeout) {
  SmoothCall first(stub_), second(stub_);
  run(first);
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_queue_timeout()->set_nanos(10'000'000);
  second.send_all(mesh_, spec);

  EXPECT_EQ(second.finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(second.details().reason, "QUEUE_TIMEOUT");
  EXPECT_EQ(server_.fake().started(), 1);
}

TEST_F(Cancel, ByCancelJobWhileReceiving) {
  SmoothCall call(stub_);
  const std::string name = receive(call);

  EXPECT_TRUE(cancel_job(name).ok());

  EXPECT_EQ(call.finish().error_code(), StatusCode::CANCELLED);
  EXPECT_EQ(call.details().reason, "CANCELLED_BY_JOB_CALL");
  EXPECT_TRUE(call.was_told_to_stop());
}

TEST_F(Cancel, ByCancelJobWhileQueuedFreesItAtOnce) {
  SmoothCall first(stub_), second(stub_);
  run(first);
  const std::string name = queue(second);

  EXPECT_TRUE(cancel_job(name).ok());

  EXPECT_EQ(get_job(stub_, name).state(), v1::STATE_CANCELLED);
  EXPECT_EQ(second.finish().error_code(), StatusCode::CANCELLED);
}

TEST_F(Cancel, ByCancelJobWhileRunning) {
  SmoothCall call(stub_);
  const std::string name = run(call);

  EXPECT_TRUE(cancel_job(name).ok());

  EXPECT_EQ(call.finish().error_code(), StatusCode::CANCELLED);
  EXPECT_EQ(call.details().reason, "CANCELLED_BY_JOB_CALL");
  expect_cancelled(name, "CANCELLED_BY_JOB_CALL");
}

TEST_F(Cancel, ByCancelJobKeepsTheResultWhenAsked) {
  SmoothCall call(stub_);
  const std::string name = run(call);

  EXPECT_TRUE(cancel_job(name, true).ok());

  ASSERT_TRUE(call.finish().ok());
  EXPECT_EQ(call.summary().value().stop_reason(), v1::STOP_REASON_CANCELLED_WITH_RESULT);
  EXPECT_EQ(call.result(), bytes_of(mesh_.coordinates));
}

TEST_F(Cancel, OfAnEndedJobChangesNothing) {
  SmoothCall call(stub_);
  call.send_all(mesh_);
  const std::string name = call.read_accepted();
  ASSERT_TRUE(call.finish().ok());

  EXPECT_TRUE(cancel_job(name).ok());
  EXPECT_EQ(get_job(stub_, name).state(), v1::STATE_SUCCEEDED);
}

TEST_F(Cancel, OfAnUnknownJobIsNotFound) {
  const grpc::Status status = cancel_job("jobs/none");

  EXPECT_EQ(status.error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(wire::decode_status_details(status.error_details())->reason, "JOB_NOT_FOUND");
}

class LostClient : public ::testing::Test {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.listen = "127.0.0.1:0";
    return config;
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
  Relay relay_{server_.server().port()};
  Stub far_stub_{grpc::CreateChannel(relay_.target(), grpc::InsecureChannelCredentials())};
  TwoTetrahedra mesh_;
};

TEST_F(LostClient, EndsAnUpload) {
  SmoothCall call(far_stub_);
  call.send(TwoTetrahedra::spec());
  const std::string name = call.read_accepted();
  relay_.cut();

  const v1::Job job = wait_for_state(stub_, name, v1::STATE_CANCELLED);
  EXPECT_EQ(job.error().reason(), "CANCELLED_BY_CLIENT");
  expect_healthy_service(stub_);
}

TEST_F(LostClient, EndsARunningJob) {
  server_.fake().hold();
  SmoothCall call(far_stub_);
  call.send_all(mesh_);
  const std::string name = call.read_accepted();
  server_.fake().wait_started(1);
  relay_.cut();

  const v1::Job job = wait_for_state(stub_, name, v1::STATE_CANCELLED);
  EXPECT_EQ(job.error().reason(), "CANCELLED_BY_CLIENT");
  server_.fake().release();
  expect_healthy_service(stub_);
}

}  // namespace
}  // namespace meshsmooth::testing
