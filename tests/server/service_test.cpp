// What goes well: answers of the service over an in-process channel.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include "server/raw_call.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth::testing {
namespace {

class Service : public ::testing::Test {
 protected:
  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
};

TEST_F(Service, ReturnsThePositionsThatTheSmootherMade) {
  SmoothCall call(stub_);
  call.send_all(mesh_);

  ASSERT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result(), mesh_.moved());
  EXPECT_EQ(call.summary().value().nodes().moved(), 4);
  expect_nothing_reserved(stub_);
}

TEST_F(Service, KeepsThePrecisionOfTheCaller) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT32);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  const std::vector<float> coordinates(15, 0.1F);
  SmoothCall call(stub_);
  call.send(spec);
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements));
  call.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(coordinates)));
  call.half_close();

  ASSERT_TRUE(call.finish().ok());
  std::vector<float> moved = coordinates;
  for (std::size_t node = 0; node < 5; ++node) moved[3 * node] += 1;
  EXPECT_EQ(call.result(), bytes_of(moved));
}

TEST_F(Service, AcceptsBeforeAnyDataAndSaysWhatItReserved) {
  server_.fake().set_estimate({.host_bytes = 1000, .device_bytes = 500});
  SmoothCall call(stub_);
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_request_id("6f1c1f0a-0000-4000-8000-0123456789ab");
  call.send(spec);

  const auto response = call.read();

  ASSERT_TRUE(response && response->has_accepted());
  const v1::Accepted& accepted = response->accepted();
  EXPECT_EQ(accepted.job().state(), v1::STATE_RECEIVING);
  EXPECT_EQ(accepted.job().request_id(), spec.request_id());
  EXPECT_EQ(accepted.job().node_count(), 5);
  EXPECT_EQ(accepted.job().element_count(), 2);
  EXPECT_GE(accepted.host_reserved_bytes(), 1000 + 157);
  EXPECT_EQ(accepted.device_reserved_bytes(), 500);
  EXPECT_EQ(server_info(stub_).backends(0).reserved_bytes(), accepted.host_reserved_bytes());
}

TEST_F(Service, HandsTheElementRegionsToTheSmootherAndReservesThem) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  const auto reserved_for = [&] {
    SmoothCall call(stub_);
    call.send(spec);
    return call.read().value().accepted().host_reserved_bytes();
  };
  const std::int64_t bytes_without_regions = reserved_for();
  spec.mutable_inline_topology()->set_element_regions_present(true);
  EXPECT_EQ(reserved_for(), bytes_without_regions + 8);

  SmoothCall call(stub_);
  call.send(spec);
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements));
  call.send(chunk(v1::ARRAY_ID_FIXED_MASK, 0, mesh_.fixed));
  call.send(chunk(v1::ARRAY_ID_ELEMENT_REGIONS, 0, bytes_of<std::int32_t>({7, -7})));
  call.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh_.coordinates)));
  call.half_close();

  ASSERT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result(), mesh_.moved());
  EXPECT_EQ(server_.fake().regions(), (std::vector<std::int32_t>{7, -7}));
  EXPECT_THAT(server_info(stub_).features(), ::testing::Contains("element_regions"));
}

TEST_F(Service, RunsAJobBeforeTheClientHalfCloses) {
  SmoothCall call(stub_);
  call.send(TwoTetrahedra::spec());
  call.send_data(mesh_);

  EXPECT_TRUE(call.finish().ok());
  EXPECT_EQ(call.result(), mesh_.moved());
}

TEST_F(Service, CutsTheResultIntoTheChunksAskedFor) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_max_result_chunk_bytes(50);
  SmoothCall call(stub_);
  call.send_all(mesh_, spec);

  ASSERT_TRUE(call.finish().ok());
  EXPECT_EQ(call.chunk_count(), 3);
  EXPECT_EQ(call.result(), mesh_.moved());
}

TEST_F(Service, TellsInTheSummaryWhatOnlyTheServerKnows) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_options()->mutable_laplacian();
  SmoothCall call(stub_);
  call.send_all(mesh_, spec);
  ASSERT_TRUE(call.finish().ok());

  const v1::Summary& summary = call.summary().value();
  EXPECT_TRUE(summary.options().has_laplacian());
  EXPECT_EQ(summary.options().max_iteration_count(), 1000);
  EXPECT_FALSE(summary.execution().server_version().empty());
  EXPECT_EQ(summary.execution().host_peak_bytes(), 157);
  EXPECT_TRUE(summary.timings().has_receive());
  EXPECT_TRUE(summary.timings().has_send());
}

TEST_F(Service, SendsNoProgressUnlessAsked) {
  server_.fake().report_progress(100);
  SmoothCall call(stub_);
  call.send_all(mesh_);

  ASSERT_TRUE(call.finish().ok());
  EXPECT_TRUE(call.progress().empty());
}

TEST_F(Service, SendsTheNewestProgressAndSkipsTheOlder) {
  constexpr int kCount = 100'000;
  server_.fake().report_progress(kCount);
  server_.fake().hold();
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_progress_interval();
  SmoothCall call(stub_);
  call.send_all(mesh_, spec);
  call.read_accepted();

  int message_count = 0;
  int iteration = 0;
  while (iteration < kCount) {
    const auto response = call.read();
    ASSERT_TRUE(response && response->has_progress());
    EXPECT_GE(response->progress().iteration(), iteration);
    iteration = response->progress().iteration();
    ++message_count;
  }
  server_.fake().release();

  EXPECT_LT(message_count, kCount / 10);
  EXPECT_TRUE(call.finish().ok());
}

TEST_F(Service, OnlyEstimatesWhenAskedToValidate) {
  server_.fake().set_estimate({.host_bytes = 1000, .device_bytes = 0});
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_validate_only(true);
  SmoothCall call(stub_);
  call.send(spec);

  const auto response = call.read();

  ASSERT_TRUE(response && response->has_accepted());
  EXPECT_GE(response->accepted().host_reserved_bytes(), 1157);
  EXPECT_TRUE(response->accepted().job().name().empty());
  EXPECT_TRUE(call.finish().ok());
  EXPECT_EQ(server_.fake().started(), 0);
  EXPECT_EQ(list_jobs(stub_).jobs_size(), 0);
  expect_nothing_reserved(stub_);
}

TEST_F(Service, RunsManyCallsAtOnce) {
  std::vector<std::unique_ptr<SmoothCall>> calls;
  for (int i = 0; i < 50; ++i) {
    calls.push_back(std::make_unique<SmoothCall>(stub_));
    calls.back()->send_all(mesh_);
  }
  for (const auto& call : calls) {
    EXPECT_TRUE(call->finish().ok());
    EXPECT_EQ(call->result(), mesh_.moved());
  }
  expect_nothing_reserved(stub_);
}

TEST_F(Service, DescribesItself) {
  const v1::GetServerInfoResponse info = server_info(stub_);

  EXPECT_THAT(info.api_versions(), ::testing::ElementsAre("meshsmooth.v1"));
  EXPECT_THAT(info.methods(),
              ::testing::ElementsAre("laplacian", "smart_laplacian", "taubin", "hc_laplacian",
                                     "optimize", "windowed_sinc", "move"));
  EXPECT_EQ(info.element_types_size(), static_cast<int>(kElementTypeCount));
  EXPECT_TRUE(info.default_options().has_optimize());
  ASSERT_EQ(info.method_defaults_size(), info.methods_size());
  for (int i = 0; i < info.methods_size(); ++i) {
    const v1::SmoothingOptions& defaults = info.method_defaults(i);
    const auto* method = v1::SmoothingOptions::descriptor()->FindFieldByName(info.methods(i));
    EXPECT_TRUE(defaults.GetReflection()->HasField(defaults, method)) << info.methods(i);
    EXPECT_EQ(defaults.max_iteration_count(), defaults.has_taubin() || defaults.has_windowed_sinc()
                                                  ? 20
                                              : defaults.has_hc_laplacian() ? 10
                                              : defaults.has_move()         ? 10000
                                                                            : 1000);
  }
  EXPECT_EQ(info.backends(0).kind(), v1::BACKEND_KIND_CPU);
  EXPECT_EQ(info.backends(0).lane_count(), 1);
  EXPECT_TRUE(info.backends(0).healthy());
  EXPECT_GT(info.limits().early_data_bytes(), 0);
  EXPECT_FALSE(info.draining());
}

TEST(ServiceWithOtherLimits, TellsAChunkThatItWouldReceive) {
  server::ServerConfig config = quiet_config();
  config.max_chunk_bytes = 8 << 20;
  config.max_receive_message_bytes = 4 << 20;
  InProcessServer server(config);
  const auto stub = v1::SmoothingService::NewStub(server.channel());

  const std::int32_t most = server_info(*stub).limits().max_chunk_bytes();

  EXPECT_LT(most, 4 << 20);
  EXPECT_GT(most, 3 << 20);
}

TEST_F(Service, IsFoundByReflection) {
  RawCall call(server_.channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo");
  call.send(string_message(7, "*"));  // list_services

  const auto answer = call.read();

  ASSERT_TRUE(answer);
  EXPECT_THAT(*answer, ::testing::HasSubstr("meshsmooth.v1.SmoothingService"));
  EXPECT_THAT(*answer, ::testing::HasSubstr("grpc.health.v1.Health"));
}

TEST(ServiceWithTheCpuBackend, ReturnsTheBitsOfTheSmootherItself) {
  // Eight tetrahedra around an off-centre node.
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>{{0.3, 0.2, 0.1}, {1, 0, 0},  {0, 1, 0}, {0, 0, 1},
                                      {-1, 0, 0},      {0, -1, 0}, {0, 0, -1}};
  mesh.blocks = {{ElementType::tetrahedron, {0, 1, 2, 3, 0, 2, 4, 3, 0, 4, 5, 3, 0, 5, 1, 3,
                                             0, 2, 1, 6, 0, 4, 2, 6, 0, 5, 4, 6, 0, 1, 5, 6}}};
  v1::JobSpec spec;
  *spec.mutable_inline_topology() = wire::encode_topology_spec(MeshTopology(mesh).view());
  spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
  server::Server server(quiet_config());
  server.start();
  Stub stub(server.in_process_channel());

  SmoothCall call(stub);
  call.send(spec);
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, bytes_of(mesh.blocks[0].nodes)));
  call.send(
      chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(std::get<std::vector<Vec3d>>(mesh.positions))));
  call.half_close();
  ASSERT_TRUE(call.finish().ok()) << call.finish().error_message();

  make_smoother("cpu", 1)->smooth(mesh, SmoothOptions{});
  EXPECT_EQ(call.result(), bytes_of(std::get<std::vector<Vec3d>>(mesh.positions)));
  EXPECT_TRUE(call.summary().value().options().has_optimize());
  EXPECT_EQ(call.summary().value().nodes().moved(), 1);
  EXPECT_EQ(call.summary().value().quality_after().inverted_element_count(), 0);
}

TEST(ServiceOnAPort, ServesOverTcp) {
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  InProcessServer server(config);
  ASSERT_GT(server.server().port(), 0);
  Stub stub(grpc::CreateChannel("127.0.0.1:" + std::to_string(server.server().port()),
                                grpc::InsecureChannelCredentials()));

  expect_healthy_service(stub);
}

TEST(ServiceOnAPort, RefusesToStartOnATakenPort) {
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  InProcessServer first(config);
  config.listen = "127.0.0.1:" + std::to_string(first.server().port());
  server::Server second(config);

  EXPECT_THROW(second.start(), InvalidOption);
}

}  // namespace
}  // namespace meshsmooth::testing
