// Metrics of every element of a result: the second array that a job sends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "server/attach_call.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// What a call was sent of a result.
struct Result {
  v1::ResultHeader header;
  std::map<v1::ArrayId, std::string> arrays;
  std::vector<std::size_t> chunk_sizes;
  v1::Summary summary;
};

/// Reads a call to its end. `skipped`: bytes of each array that it was not to be sent.
template <class Call>
Result read_result(Call& call, std::map<v1::ArrayId, std::int64_t> skipped = {}) {
  Result result;
  while (const auto response = call.read()) {
    if (response->has_result()) result.header = response->result();
    if (response->has_summary()) result.summary = response->summary();
    if (!response->has_chunk()) continue;
    const v1::Chunk& chunk = response->chunk();
    std::string& array = result.arrays[chunk.array_id()];
    EXPECT_EQ(chunk.offset_bytes(),
              skipped[chunk.array_id()] + static_cast<std::int64_t>(array.size()));
    array += chunk.data();
    result.chunk_sizes.push_back(chunk.data().size());
  }
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  return result;
}

std::string expected_quality(const std::vector<QualityMetric>& metrics) {
  std::vector<float> values;
  for (const QualityMetric metric : metrics) {
    for (std::size_t e = 0; e < 2; ++e) {
      values.push_back(FakeSmoother::element_quality(metric, e));
    }
  }
  return bytes_of(values);
}

class ElementQuality : public ::testing::Test {
 protected:
  explicit ElementQuality(server::ServerConfig config = quiet_config())
      : server_(std::move(config)) {}

  static v1::JobSpec spec() {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.add_element_quality_metrics(v1::QUALITY_METRIC_MIN_DIHEDRAL_ANGLE);
    spec.add_element_quality_metrics(v1::QUALITY_METRIC_MEAN_RATIO);
    return spec;
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
  const std::string quality_ =
      expected_quality({QualityMetric::min_dihedral_angle, QualityMetric::mean_ratio});
};

TEST_F(ElementQuality, FollowsThePositions) {
  SmoothCall call(stub_);
  call.send_all(mesh_, spec());

  const Result result = read_result(call);

  EXPECT_EQ(result.arrays.at(v1::ARRAY_ID_COORDINATES), mesh_.moved());
  EXPECT_EQ(result.arrays.at(v1::ARRAY_ID_ELEMENT_QUALITY), quality_);
  EXPECT_EQ(result.header.size_bytes(), 120 + 16);
  EXPECT_THAT(result.header.element_quality_metrics(),
              ElementsAre(v1::QUALITY_METRIC_MIN_DIHEDRAL_ANGLE, v1::QUALITY_METRIC_MEAN_RATIO));
  EXPECT_EQ(result.summary.nodes().moved(), 4);
  expect_nothing_reserved(stub_);
}

TEST_F(ElementQuality, IsAbsentUnlessAskedFor) {
  SmoothCall call(stub_);
  call.send_all(mesh_);

  const Result result = read_result(call);

  EXPECT_EQ(result.arrays.size(), 1U);
  EXPECT_EQ(result.header.size_bytes(), 120);
  EXPECT_EQ(result.header.element_quality_metrics_size(), 0);
}

TEST_F(ElementQuality, IsCutIntoTheChunksAskedFor) {
  v1::JobSpec small = spec();
  small.set_max_result_chunk_bytes(50);
  SmoothCall call(stub_);
  call.send_all(mesh_, small);

  EXPECT_THAT(read_result(call).chunk_sizes, ElementsAre(50, 50, 20, 16));
}

TEST_F(ElementQuality, IsReservedWithTheJob) {
  const auto reserved_for = [&](const v1::JobSpec& spec) {
    SmoothCall call(stub_);
    call.send(spec);
    return call.read().value().accepted().host_reserved_bytes();
  };

  EXPECT_EQ(reserved_for(spec()), reserved_for(TwoTetrahedra::spec()) + 16);
}

TEST_F(ElementQuality, IsSentToWhoAttachesFromAnyOffset) {
  server_.keeps_something();
  v1::JobSpec kept = spec();
  kept.mutable_result_ttl()->set_seconds(3600);
  SmoothCall call(stub_);
  call.send_all(mesh_, kept);
  const std::string name = call.read_accepted();
  read_result(call);

  for (const std::int64_t offset : {0, 50, 120, 128}) {
    AttachCall attach(stub_, name, offset);
    const std::int64_t in_quality = std::max<std::int64_t>(offset - 120, 0);
    const Result rest = read_result(
        attach, {{v1::ARRAY_ID_COORDINATES, offset}, {v1::ARRAY_ID_ELEMENT_QUALITY, in_quality}});
    EXPECT_EQ(rest.arrays.contains(v1::ARRAY_ID_COORDINATES), offset < 120);
    EXPECT_EQ(rest.arrays.at(v1::ARRAY_ID_ELEMENT_QUALITY),
              quality_.substr(static_cast<std::size_t>(in_quality)));
    EXPECT_EQ(rest.header.element_quality_metrics_size(), 2);
  }
  AttachCall at_end(stub_, name, 136);
  EXPECT_TRUE(read_result(at_end).arrays.empty());
  AttachCall past_end(stub_, name, 137);
  EXPECT_EQ(past_end.finish().error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST_F(ElementQuality, ComesOnATopologyThatTheServerKeeps) {
  server_.keeps_something();
  v1::JobSpec first = spec();
  first.set_topology_kept(true);
  SmoothCall inline_call(stub_);
  inline_call.send_all(mesh_, first);
  v1::JobSpec named = spec();
  named.set_topology_name(read_result(inline_call).header.topology_name());
  SmoothCall call(stub_);
  call.send(named);
  call.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh_.coordinates)));
  call.half_close();

  const Result result = read_result(call);

  EXPECT_TRUE(result.summary.execution().topology_reused());
  EXPECT_EQ(result.arrays.at(v1::ARRAY_ID_ELEMENT_QUALITY), quality_);
}

TEST_F(ElementQuality, IsPartOfWhatDefinesAJob) {
  server_.fake().hold();
  v1::JobSpec asked = spec();
  asked.set_request_id("01234567-89ab-cdef-0123-456789abcdef");
  SmoothCall first(stub_);
  first.send_all(mesh_, asked);
  first.read_accepted();
  asked.mutable_element_quality_metrics()->RemoveLast();
  SmoothCall other(stub_);
  other.send(asked);

  EXPECT_EQ(other.finish().error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(other.detail("field"), "element_quality_metrics");
}

TEST_F(ElementQuality, OfAnUnknownOrRepeatedMetricIsRefused) {
  const auto expect_refused = [&](std::initializer_list<int> metrics, const std::string& reason,
                                  const std::string& what) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    for (const int metric : metrics) {
      spec.add_element_quality_metrics(static_cast<v1::QualityMetric>(metric));
    }
    SmoothCall call(stub_);
    call.send(spec);
    EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(call.details().reason, reason);
    EXPECT_EQ(call.detail("field"), "element_quality_metrics");
    EXPECT_THAT(call.finish().error_message(), HasSubstr(what));
  };
  expect_refused({99}, "OPTION_NOT_SUPPORTED", "99");
  expect_refused({1, 0}, "OPTION_NOT_SUPPORTED", "0");
  expect_refused({-1}, "OPTION_NOT_SUPPORTED", "-1");
  expect_refused({1, 3, 1}, "OPTION_OUT_OF_RANGE", "mean_ratio");
  expect_healthy_service(stub_);
}

TEST_F(ElementQuality, IsAFeatureOfTheServer) {
  EXPECT_THAT(server_info(stub_).features(), Contains("element_quality"));
}

class ElementQualityOfFewKeptBytes : public ElementQuality {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.max_kept_result_bytes = 130;
    return config;
  }
  ElementQualityOfFewKeptBytes() : ElementQuality(config()) {}
};

TEST_F(ElementQualityOfFewKeptBytes, CountsAsPartOfTheResult) {
  server_.keeps_something();
  const auto code_of = [&](v1::JobSpec spec) {
    spec.mutable_result_ttl()->set_seconds(60);
    SmoothCall call(stub_);
    call.send_all(mesh_, spec);
    return call.finish().error_code();
  };

  EXPECT_EQ(code_of(TwoTetrahedra::spec()), grpc::StatusCode::OK);
  EXPECT_EQ(code_of(spec()), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

}  // namespace
}  // namespace meshsmooth::testing
