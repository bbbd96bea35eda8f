#include "meshsmooth/client.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "client_access.hpp"
#include "mock_service.hpp"
#include "support/fit_surfaces.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using meshsmooth::testing::InProcessServer;
using meshsmooth::testing::MockServer;
using ::testing::Contains;
using ::testing::HasSubstr;

Client connect(InProcessServer& server) { return ClientAccess::make(server.channel()); }

TEST(Client, SmoothsThroughTheRealServer) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  mesh.fixed = {1, 0, 0, 0, 0, 0, 0};
  const Mesh before = mesh;

  const SmoothReport report = connect(server).smooth(mesh, {});

  EXPECT_EQ(test::points(mesh)[0], test::points(before)[0]);
  EXPECT_EQ(test::points(mesh)[1].x, test::points(before)[1].x + 1);
  EXPECT_EQ(report.summary.stop_reason, StopReason::converged);
  EXPECT_EQ(report.summary.nodes.moved, 6);
  EXPECT_THAT(report.job_name, HasSubstr("jobs/"));
  EXPECT_THAT(report.to_json(), HasSubstr("\"stop_reason\": \"STOP_REASON_CONVERGED\""));
}

TEST(Client, PutsAResultWhereThePositionsBeforeTheLastOneWere) {
  InProcessServer server;
  Client client = connect(server);
  Mesh mesh = test::lattice(ElementType::tetrahedron, 36);  // 1.2 MB of positions
  test::points(mesh).shrink_to_fit();
  const std::vector<Vec3d> before = test::points(mesh);
  const Vec3d* const first = test::points(mesh).data();
  client.smooth(mesh, {});
  const Vec3d* const second = test::points(mesh).data();

  client.smooth(mesh, {});
  EXPECT_EQ(test::points(mesh).data(), first);
  Mesh other = test::lattice(ElementType::tetrahedron, 2);
  client.smooth(other, {});
  client.smooth(mesh, {});
  EXPECT_EQ(test::points(mesh).data(), second);

  for (std::size_t node = 0; node < before.size(); ++node) {
    const Vec3d moved = before[node] + Vec3d{3, 0, 0};
    ASSERT_EQ(test::points(mesh)[node], moved) << node;
  }
}

TEST(Client, SendsRegions) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  mesh.regions = {4, 4, 4, 4, -9, -9, -9, -9};

  connect(server).smooth(mesh, {});

  EXPECT_EQ(server.fake().regions(), mesh.regions);
}

TEST(Client, SendsPairsOfNodesThatTheServerHolds) {
  InProcessServer server;
  const std::vector<NodePair> pairs = {{1, 4}, {2, 2}, {4, 3}};
  for (Mesh mesh : {test::tet_ball(), test::as_float32(test::tet_ball())}) {
    connect(server).smooth(mesh, {}, {}, {.node_pairs = pairs});
    EXPECT_EQ(server.fake().node_pairs(), pairs);
  }
  Mesh mesh = test::tet_ball();
  connect(server).smooth(mesh, {});
  EXPECT_TRUE(server.fake().node_pairs().empty()) << "they are of one job";

  const std::vector<NodePair> outside = {{1, 7}};
  EXPECT_THROW(connect(server).smooth(mesh, {}, {}, {.node_pairs = outside}), InvalidMesh);
}

TEST(Client, SendsTheReferenceInTheMeshsPrecision) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  Mesh reference = mesh;
  test::points(reference)[3] = {0.5, 0.25, 7};
  test::points(reference)[6] = {0.25, 0.5, -0.25};  // exact in float32
  const Mesh in_float32 = test::as_float32(reference);
  for (const Mesh* const given : {static_cast<const Mesh*>(&reference), &in_float32}) {
    connect(server).smooth(mesh, {}, {}, {.reference = given->positions_view()});
    EXPECT_EQ(server.fake().reference().first, test::points(reference));
    EXPECT_TRUE(server.fake().reference().second);
  }
  Mesh small = test::as_float32(mesh);
  connect(server).smooth(small, {}, {}, {.reference = reference.positions_view()});
  EXPECT_EQ(server.fake().reference().first, test::points(reference));
  EXPECT_FALSE(server.fake().reference().second);

  connect(server).smooth(mesh, {});
  EXPECT_TRUE(server.fake().reference().first.empty());

  const Mesh other = test::two_tets();
  EXPECT_THROW(connect(server).smooth(mesh, {}, {}, {.reference = other.positions_view()}),
               InvalidMesh);
}

/// The field of the input that is refused before anything is sent, or "".
std::string refused_field(const SmoothOptions& options, const JobInput& input) {
  InProcessServer server;
  server.keeps_something();  // the topology of the session
  Client client = connect(server);
  Mesh mesh = test::tet_ball();
  Session session = client.open(mesh);
  const auto field_of = [&](const auto& run) -> std::string {
    try {
      run();
    } catch (const NotSupported& error) {
      EXPECT_EQ(error.reason(), "OPTION_NOT_SUPPORTED");
      EXPECT_EQ(find_error_reason(error.reason())->status, StatusCode::invalid_argument);
      return error.details().front().second;
    }
    return "";
  };
  const std::string field = field_of([&] { client.smooth(mesh, options, {}, input); });
  EXPECT_EQ(field_of([&] { session.smooth(options, {}, input); }), field);
  EXPECT_EQ(client.list_jobs().empty(), !field.empty());
  return field;
}

TEST(Client, RefusesInputThatTheJobHasNoUseFor) {
  const Mesh mesh = test::tet_ball();
  const std::vector<NodeId> nodes = {1};
  const std::vector<Vec3d> to = {{0, 0, 0}};
  const SurfaceMesh surface = test::box_surface(1, {1, 1, 1});
  const JobInput reference{.reference = mesh.positions_view()};
  const JobInput prescribed{.prescribed = {nodes, std::span<const Vec3d>(to)}};
  const JobInput positions{.prescribed = {{}, std::span<const Vec3d>(to)}};
  const JobInput target{.surface = &surface};
  for_each_method([&](const auto& method) {
    SmoothOptions options{.method = method, .boundary = BoundaryPolicy::slide};
    const bool optimizes = std::holds_alternative<Optimize>(options.method);
    if (is_motion(options.method)) {
      const auto with = [&](JobInput input) {
        input.prescribed = prescribed.prescribed;
        return refused_field(options, input);
      };
      EXPECT_EQ(with(reference), "reference");
      EXPECT_EQ(with(target), "surface");
      return;
    }
    EXPECT_EQ(refused_field(options, reference), optimizes ? "" : "reference");
    EXPECT_EQ(refused_field(options, target), optimizes ? "" : "surface");
    EXPECT_EQ(refused_field(options, prescribed), "prescribed");
    EXPECT_EQ(refused_field(options, positions), "prescribed");
  });
  EXPECT_EQ(refused_field({.method = Optimize{.target = Target::ideal}}, reference),
            "optimize.target");
  EXPECT_EQ(refused_field({}, target), "surface") << "the boundary is fixed";
  SmoothOptions options{.boundary = BoundaryPolicy::slide, .only_below = OnlyBelow{0.5}};
  EXPECT_EQ(refused_field(options, target), "surface");
}

TEST(Client, GivesTheServersReasonForTooFewRegions) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  mesh.regions = {4, 4};
  try {
    connect(server).smooth(mesh, {});
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::invalid_argument);
    EXPECT_THAT(error.what(), HasSubstr("expected ARRAY_ID_ELEMENT_REGIONS at byte 8"));
  }
}

TEST(Client, SmoothsMixedFloat32MeshesThroughTheRealServer) {
  InProcessServer server;
  Mesh mesh = test::as_float32(test::mixed_stack(3));
  const auto before = std::get<std::vector<Vec3f>>(mesh.positions);

  connect(server).smooth(mesh, {});

  const auto& after = std::get<std::vector<Vec3f>>(mesh.positions);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) EXPECT_EQ(after[i].x, before[i].x + 1);
}

TEST(Client, GivesTheServersReasonForABadMesh) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  mesh.blocks[0].nodes.push_back(0);  // a fraction of an element
  try {
    connect(server).smooth(mesh, {});
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::invalid_argument);
    EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
    EXPECT_EQ(error.hint(), "");
  }
}

TEST(Client, GivesTheServersReasonForAnOptionOutOfRange) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  SmoothOptions options;
  options.max_iterations = -1;
  try {
    connect(server).smooth(mesh, options);
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "OPTION_OUT_OF_RANGE");
    EXPECT_THAT(error.details(), Contains(::testing::Key("field")));
  }
}

TEST(Client, RefusesAnUnknownBackend) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  RequestOptions request;
  request.backend = "abacus";
  try {
    connect(server).smooth(mesh, {}, request);
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::invalid_argument);
    EXPECT_EQ(error.reason(), "OPTION_OUT_OF_RANGE");
  }
}

TEST(Client, RefusesAnInvalidTraceparent) {
  InProcessServer server;
  Mesh mesh = test::tet_ball();
  RequestOptions request;
  request.traceparent = "00-4bf9-00f0-01";
  EXPECT_THROW(connect(server).smooth(mesh, {}, request), InvalidOption);
  request.traceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  EXPECT_NO_THROW(connect(server).smooth(mesh, {}, request));
}

TEST(Client, TellsWhatTheServerIs) {
  InProcessServer server;

  const ServerInfo info = connect(server).server_info();

  EXPECT_FALSE(info.version.empty());
  EXPECT_THAT(info.methods, Contains("smart_laplacian"));
  EXPECT_FALSE(info.draining);
  EXPECT_THAT(info.json, HasSubstr("\"max_node_count\""));
}

TEST(Client, RefusesAJobWithATimeThatIsNone) {
  MockServer server;
  server.service.on_list_jobs = [](const v1::ListJobsRequest&) {
    v1::ListJobsResponse response;
    response.add_jobs()->mutable_end_time()->set_nanos(-1);
    return response;
  };
  try {
    (void)Client(server.address()).list_jobs();
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::data_loss);
  }
}

TEST(Client, AsksForHealth) {
  InProcessServer server;

  EXPECT_TRUE(connect(server).healthy());
}

TEST(Client, ListsGetsAndCancelsARunningJobKeepingItsResult) {
  InProcessServer server;
  server.fake().hold();
  Client client = connect(server);
  Mesh mesh = test::tet_ball();
  StopReason stop_reason{};
  std::jthread caller([&] { stop_reason = client.smooth(mesh, {}).summary.stop_reason; });
  server.fake().wait_started(1);

  const std::vector<JobInfo> jobs = client.list_jobs();
  ASSERT_EQ(jobs.size(), 1);
  const JobInfo job = client.get_job(jobs[0].name);
  client.cancel_job(job.name, true);
  caller.join();

  EXPECT_EQ(job.state, JobState::running);
  EXPECT_EQ(job.node_count, 7);
  EXPECT_EQ(job.element_count, 8);
  EXPECT_EQ(stop_reason, StopReason::cancelled_with_result);
}

TEST(Client, NamesAnUnknownJob) {
  InProcessServer server;
  try {
    connect(server).cancel_job("jobs/nobody");
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::not_found);
    EXPECT_EQ(error.reason(), "JOB_NOT_FOUND");
  }
}

TEST(Client, FollowsThePagesOfAListOfJobs) {
  MockServer server;
  server.service.on_list_jobs = [](const v1::ListJobsRequest& request) {
    v1::ListJobsResponse response;
    response.add_jobs()->set_name("jobs/" + request.page_token());
    if (request.page_token().empty()) response.set_next_page_token("2");
    return response;
  };

  const std::vector<JobInfo> jobs = Client(server.address()).list_jobs();

  ASSERT_EQ(jobs.size(), 2);
  EXPECT_EQ(jobs[0].name, "jobs/");
  EXPECT_EQ(jobs[1].name, "jobs/2");
}

}  // namespace
}  // namespace meshsmooth::client
