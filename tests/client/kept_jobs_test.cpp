// Retries, jobs that are joined, and results fetched later.
#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "client_access.hpp"
#include "mock_service.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using meshsmooth::testing::InProcessServer;
using meshsmooth::testing::MockServer;
using meshsmooth::testing::ServerStream;
using namespace std::chrono_literals;

Client connect(InProcessServer& server) { return ClientAccess::make(server.channel()); }

class Retries : public ::testing::Test {
 protected:
  /// The server refuses so often, then serves.
  void refuse(int times, grpc::StatusCode code, std::optional<std::chrono::nanoseconds> delay) {
    server_.service.on_smooth = [=, this](grpc::ServerContext&, ServerStream& stream) {
      ids_.push_back(testing::read_spec(stream).request_id());
      if (static_cast<int>(ids_.size()) <= times) {
        testing::stop_sending(stream);
        testing::read_upload(stream);
        return testing::refusal(code, "WHY", "why", {}, delay);
      }
      testing::accept(stream);
      testing::read_upload(stream);
      testing::send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
      testing::send_chunk(stream, 0, std::string(7 * 24, '\0'));
      testing::send_summary(stream);
      return grpc::Status::OK;
    };
  }

  MockServer server_;
  std::vector<std::string> ids_;
  Client client_{server_.address()};
  Mesh mesh_ = test::tet_ball();
};

TEST_F(Retries, SendTheSameRequestAgainWhenTheServerIsBusy) {
  refuse(2, grpc::StatusCode::RESOURCE_EXHAUSTED, 1ms);

  client_.smooth(mesh_, {});

  ASSERT_EQ(ids_.size(), 3U);
  EXPECT_EQ(ids_[0], ids_[1]);
  EXPECT_EQ(ids_[0], ids_[2]);
}

TEST_F(Retries, ComeAtOnceWithLittleDataWhenMuchWasCutOffUnanswered) {
  refuse(0, grpc::StatusCode::OK, {});
  client_.smooth(mesh_, {});  // accepted: the next may send much
  int call_count = 0;
  server_.service.on_smooth = [&](grpc::ServerContext&, ServerStream&) {
    ++call_count;
    return grpc::Status(grpc::StatusCode::INTERNAL, "RST_STREAM");  // as if a proxy had cut it off
  };
  RequestOptions once;
  once.max_attempts = 1;

  EXPECT_THROW(client_.smooth(mesh_, {}, once), ServiceError);
  EXPECT_EQ(call_count, 2);
  EXPECT_THROW(client_.smooth(mesh_, {}, once), ServiceError);
  EXPECT_EQ(call_count, 3) << "nothing was accepted before: it sent little";
}

TEST_F(Retries, EndWithTheDeadlineHoweverMuchWasInFlight) {
  refuse(0, grpc::StatusCode::OK, {});
  client_.smooth(mesh_, {});
  int call_count = 0;
  server_.service.on_smooth = [&](grpc::ServerContext&, ServerStream&) {
    ++call_count;
    // As gRPC says it itself.
    return grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "Deadline Exceeded");
  };
  try {
    client_.smooth(mesh_, {});
    ADD_FAILURE();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::deadline_exceeded);
  }
  EXPECT_EQ(call_count, 1);
}

TEST_F(Retries, EndAfterSoManyAttempts) {
  refuse(100, grpc::StatusCode::UNAVAILABLE, 0ms);
  RequestOptions request;
  request.max_attempts = 2;

  EXPECT_THROW(client_.smooth(mesh_, {}, request), ServiceError);
  EXPECT_EQ(ids_.size(), 2U);
}

TEST_F(Retries, AreNotMadeOfWhatFailsTheSameWayAgain) {
  refuse(100, grpc::StatusCode::RESOURCE_EXHAUSTED, {});

  EXPECT_THROW(client_.smooth(mesh_, {}), ServiceError);
  EXPECT_EQ(ids_.size(), 1U);
}

TEST_F(Retries, StayWithinTheTimeout) {
  refuse(100, grpc::StatusCode::RESOURCE_EXHAUSTED, 1h);
  RequestOptions request;
  request.timeout = 10s;
  try {
    client_.smooth(mesh_, {}, request);
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "WHY");
    EXPECT_EQ(error.retry_delay(), 1h);
  }
}

TEST_F(Retries, EndWhenTheCallerStops) {
  refuse(100, grpc::StatusCode::RESOURCE_EXHAUSTED, 100s);
  std::stop_source stop;
  RequestOptions request;
  request.stop = stop.get_token();
  std::thread stopper([&] {
    std::this_thread::sleep_for(50ms);
    stop.request_stop();
  });
  try {
    client_.smooth(mesh_, {}, request);
    ADD_FAILURE();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::cancelled);
  }
  stopper.join();
}

TEST(Attach, TakesTheResultOfAJobThatWasLeft) {
  InProcessServer server;
  server.fake().hold();
  Mesh mesh = test::tet_ball();
  const Mesh before = mesh;
  RequestOptions request;
  request.result_ttl = 60s;
  std::stop_source stop;
  request.stop = stop.get_token();
  std::thread leaver([&] {
    server.fake().wait_started(1);
    stop.request_stop();
  });
  EXPECT_THROW(connect(server).smooth(mesh, {}, request), ServiceError);
  leaver.join();
  const std::string name = connect(server).list_jobs().at(0).name;
  server.fake().release();

  const SmoothReport report = connect(server).attach(name, mesh);

  EXPECT_EQ(report.summary.stop_reason, StopReason::converged);
  EXPECT_EQ(report.job_name, name);
  for (std::size_t i = 0; i < before.node_count(); ++i) {
    EXPECT_EQ(test::points(mesh)[i].x, test::points(before)[i].x + 1);
  }
  connect(server).delete_job(name);
  EXPECT_THROW(connect(server).attach(name, mesh), ServiceError);
}

TEST(Attach, GoesOnWhereTheConnectionBroke) {
  MockServer server;
  std::vector<std::int64_t> offsets;
  server.service.on_attach_job = [&](const v1::AttachJobRequest& request,
                                     grpc::ServerWriter<v1::AttachJobResponse>& stream) {
    offsets.push_back(request.result_offset_bytes());
    v1::AttachJobResponse response;
    response.mutable_result()->set_node_count(7);
    response.mutable_result()->set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    response.mutable_result()->set_size_bytes(7 * 24);
    stream.Write(response);
    response.mutable_chunk()->set_array_id(v1::ARRAY_ID_COORDINATES);
    response.mutable_chunk()->set_offset_bytes(request.result_offset_bytes());
    response.mutable_chunk()->set_data(std::string(2 * 24, '\0'));
    if (offsets.size() < 3) {
      stream.Write(response);
      return grpc::Status(grpc::StatusCode::UNAVAILABLE, "Socket closed");
    }
    response.mutable_chunk()->set_data(std::string(3 * 24, '\0'));
    stream.Write(response);
    response.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
    stream.Write(response);
    return grpc::Status::OK;
  };
  Mesh mesh = test::tet_ball();

  Client(server.address()).attach("jobs/1", mesh);

  EXPECT_THAT(offsets, ::testing::ElementsAre(0, 48, 96));
  EXPECT_EQ(test::points(mesh)[6].x, 0);
}

}  // namespace
}  // namespace meshsmooth::client
