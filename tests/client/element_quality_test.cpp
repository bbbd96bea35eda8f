// Metrics of every element of a result, as the client receives them.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "client_access.hpp"
#include "mock_service.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using namespace std::chrono_literals;
using namespace meshsmooth::testing;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const SmoothOptions kOptions = {
    .element_quality_metrics = {QualityMetric::radius_ratio, QualityMetric::mean_ratio}};

Client connect(InProcessServer& server) { return ClientAccess::make(server.channel()); }

void expect_the_fakes(const ElementQualityArrays& found, const Mesh& mesh) {
  EXPECT_EQ(found.metrics, kOptions.element_quality_metrics);
  ASSERT_EQ(found.values.size(), 2 * mesh.element_count());
  for (std::size_t m = 0; m < 2; ++m) {
    for (std::size_t e = 0; e < mesh.element_count(); ++e) {
      EXPECT_EQ(found.of(m)[e], FakeSmoother::element_quality(found.metrics[m], e));
    }
  }
}

TEST(ElementQuality, ComesWithTheReport) {
  InProcessServer server;
  Mesh mesh = test::noisy(test::mixed_stack(12), 0.1, 3);
  const Mesh before = mesh;

  const SmoothReport report = connect(server).smooth(mesh, kOptions);

  expect_the_fakes(report.summary.element_quality, mesh);
  EXPECT_EQ(test::points(mesh)[1].x, test::points(before)[1].x + 1);
}

TEST(ElementQuality, IsAbsentUnlessAskedFor) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();

  const SmoothReport report = connect(server).smooth(mesh, {});

  EXPECT_TRUE(report.summary.element_quality.metrics.empty());
  EXPECT_TRUE(report.summary.element_quality.values.empty());
}

TEST(ElementQuality, ComesWithEveryJobOfASession) {
  InProcessServer server;
  server.keeps_something();
  Client client = connect(server);
  const Mesh mesh = test::tet_ball();
  Session session = client.open(mesh);
  std::vector<Vec3d> positions = test::points(mesh);

  for (int step = 0; step < 2; ++step) {
    expect_the_fakes(session.smooth(positions, kOptions).summary.element_quality, mesh);
  }
}

TEST(ElementQuality, ComesToWhoAttaches) {
  InProcessServer server;
  server.keeps_something();
  Mesh mesh = test::tet_ball();
  RequestOptions request;
  request.result_ttl = 60s;
  const std::string name = connect(server).smooth(mesh, kOptions, request).job_name;

  const SmoothReport report = connect(server).attach(name, mesh);

  expect_the_fakes(report.summary.element_quality, mesh);
}

TEST(ElementQuality, IsAFeatureThatTheServerTells) {
  InProcessServer server;

  EXPECT_THAT(connect(server).server_info().features, Contains("element_quality"));
}

TEST(ElementQuality, OfAMetricTwiceIsRefusedByTheServer) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  try {
    connect(server).smooth(
        mesh, {.element_quality_metrics = {QualityMetric::mean_ratio, QualityMetric::mean_ratio}});
    FAIL() << "accepted";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "OPTION_OUT_OF_RANGE");
    EXPECT_THAT(error.what(), HasSubstr("element_quality_metrics: mean_ratio"));
  }
}

/// A server's answer to a whole upload of the ball of tetrahedra: 168 bytes of positions.
ServiceError error_of_answer(const std::function<void(ServerStream&)>& answer) {
  MockServer server;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    const v1::JobSpec spec = read_spec(stream);
    EXPECT_THAT(spec.element_quality_metrics(),
                ElementsAre(v1::QUALITY_METRIC_RADIUS_RATIO, v1::QUALITY_METRIC_MEAN_RATIO));
    accept(stream);
    read_upload(stream);
    answer(stream);
    return grpc::Status::OK;
  };
  Mesh mesh = test::tet_ball();
  const Mesh before = mesh;
  try {
    Client(server.address()).smooth(mesh, kOptions);
  } catch (const ServiceError& error) {
    EXPECT_EQ(mesh.positions, before.positions);
    return error;
  }
  ADD_FAILURE() << "the call succeeded";
  return {StatusCode::unknown, "", "", {}, ""};
}

void send_header(ServerStream& stream, std::initializer_list<int> metrics,
                 std::int64_t size_bytes) {
  v1::SmoothResponse response;
  response.mutable_result()->set_node_count(7);
  response.mutable_result()->set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
  response.mutable_result()->set_size_bytes(size_bytes);
  for (const int metric : metrics) {
    response.mutable_result()->add_element_quality_metrics(static_cast<v1::QualityMetric>(metric));
  }
  stream.Write(response);
}

void send_values(ServerStream& stream, std::int64_t offset, std::size_t size_bytes) {
  v1::SmoothResponse response;
  response.mutable_chunk()->set_array_id(v1::ARRAY_ID_ELEMENT_QUALITY);
  response.mutable_chunk()->set_offset_bytes(offset);
  response.mutable_chunk()->set_data(std::string(size_bytes, 'x'));
  stream.Write(response);
}

const auto kElements = static_cast<std::int64_t>(test::tet_ball().element_count());
const std::int64_t kBytes = 168 + 2 * 4 * kElements;

TEST(ElementQuality, GoesOnWhereTheConnectionBroke) {
  MockServer server;
  std::vector<std::int64_t> offsets;
  server.service.on_attach_job = [&](const v1::AttachJobRequest& request,
                                     grpc::ServerWriter<v1::AttachJobResponse>& stream) {
    offsets.push_back(request.result_offset_bytes());
    v1::AttachJobResponse response;
    response.mutable_result()->set_node_count(7);
    response.mutable_result()->set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    response.mutable_result()->set_size_bytes(168 + 4 * kElements);
    response.mutable_result()->add_element_quality_metrics(v1::QUALITY_METRIC_MEAN_RATIO);
    stream.Write(response);
    const auto send = [&](v1::ArrayId array, std::int64_t offset, std::int64_t size_bytes) {
      response.mutable_chunk()->set_array_id(array);
      response.mutable_chunk()->set_offset_bytes(offset);
      response.mutable_chunk()->set_data(std::string(static_cast<std::size_t>(size_bytes), '\0'));
      stream.Write(response);
    };
    if (offsets.size() == 1) {
      send(v1::ARRAY_ID_COORDINATES, 0, 168);
      send(v1::ARRAY_ID_ELEMENT_QUALITY, 0, 6);  // within a value
      return grpc::Status(grpc::StatusCode::UNAVAILABLE, "Socket closed");
    }
    send(v1::ARRAY_ID_ELEMENT_QUALITY, 6, 4 * kElements - 6);
    response.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
    stream.Write(response);
    return grpc::Status::OK;
  };
  Mesh mesh = test::tet_ball();

  const SmoothReport report = Client(server.address()).attach("jobs/1", mesh);

  EXPECT_THAT(offsets, ElementsAre(0, 174));
  EXPECT_EQ(report.summary.element_quality.values,
            std::vector<float>(static_cast<std::size_t>(kElements), 0.0F));
}

TEST(ElementQuality, IsMissedOfAnOlderServer) {
  const ServiceError error =
      error_of_answer([](ServerStream& stream) { send_header(stream, {}, 168); });

  EXPECT_EQ(error.code(), StatusCode::invalid_argument);
  EXPECT_EQ(error.reason(), "OPTION_NOT_SUPPORTED");
  EXPECT_THAT(error.what(), HasSubstr("feature element_quality"));
}

struct BrokenAnswer {
  const char* name;
  std::function<void(ServerStream&)> answer;
  std::string message;
};

class BrokenElementQuality : public ::testing::TestWithParam<BrokenAnswer> {};

TEST_P(BrokenElementQuality, IsRefusedAndTheMeshStaysAsItWas) {
  const ServiceError error = error_of_answer(GetParam().answer);

  EXPECT_EQ(error.code(), StatusCode::data_loss);
  EXPECT_THAT(error.what(), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenElementQuality,
    ::testing::Values(BrokenAnswer{"UnknownMetric",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 99}, kBytes);
                                   },
                                   "unknown metric 99"},
                      BrokenAnswer{"MetricTwice",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 3}, kBytes);
                                   },
                                   "listed twice"},
                      BrokenAnswer{"OtherSize",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 1}, 168);
                                   },
                                   "it must have " + std::to_string(kBytes)},
                      BrokenAnswer{"BeforeThePositions",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 1}, kBytes);
                                     send_values(stream, 0, 8);
                                   },
                                   "were due"},
                      BrokenAnswer{"Gap",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 1}, kBytes);
                                     send_chunk(stream, 0, std::string(168, 'x'));
                                     send_values(stream, 8, 8);
                                   },
                                   "at 8 where those at 0 were due"},
                      BrokenAnswer{"Truncated",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 1}, kBytes);
                                     send_chunk(stream, 0, std::string(168, 'x'));
                                     send_values(stream, 0, 4);
                                     send_summary(stream);
                                   },
                                   "172 of " + std::to_string(kBytes)},
                      BrokenAnswer{"TooLong",
                                   [](ServerStream& stream) {
                                     send_header(stream, {3, 1}, kBytes);
                                     send_chunk(stream, 0, std::string(168, 'x'));
                                     send_values(stream, 0, static_cast<std::size_t>(kBytes) - 167);
                                   },
                                   "more result bytes"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace meshsmooth::client
