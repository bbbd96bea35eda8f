// A moving mesh, whose topology the server keeps.
#include <gmock/gmock.h>

#include <chrono>
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

Client connect(InProcessServer& server) { return ClientAccess::make(server.channel()); }

TEST(Session, SmoothsPositionsThroughTheRealServer) {
  InProcessServer server;
  server.keeps_something();
  Client client = connect(server);
  Mesh mesh = test::tet_ball();
  mesh.fixed = {1, 0, 0, 0, 0, 0, 0};
  Session session = client.open(mesh);
  std::vector<Vec3d> positions = test::points(mesh);

  for (int step = 1; step <= 3; ++step) {
    const SmoothReport report = session.smooth(positions, {});
    EXPECT_EQ(report.topology_reused, step > 1);
    EXPECT_EQ(positions[0], test::points(mesh)[0]);
    EXPECT_EQ(positions[1].x, test::points(mesh)[1].x + step);
  }
  EXPECT_EQ(server.fake().prepared(), 1);
  std::vector<Vec3f> in_float32(7, Vec3f{0, 0, 0});
  session.smooth(in_float32, {});
  EXPECT_EQ(in_float32[6].x, 1);
}

TEST(Session, SendsAReferenceWithEachJobThatHasOne) {
  InProcessServer server;
  server.keeps_something();
  Client client = connect(server);
  Mesh mesh = test::tet_ball();
  Session session = client.open(mesh);
  std::vector<Vec3d> positions = test::points(mesh);
  for (int step = 0; step < 3; ++step) {
    Mesh reference = mesh;
    test::points(reference)[2].y = step;
    const SmoothReport report =
        session.smooth(positions, {}, {}, {.reference = reference.positions_view()});
    EXPECT_EQ(report.topology_reused, step > 0);
    EXPECT_EQ(server.fake().reference().first, test::points(reference));
  }
  session.smooth(positions, {});
  EXPECT_TRUE(server.fake().reference().first.empty());
}

/// The server keeps the reference with the topology, and the answer replaces nothing of it.
TEST(Session, MovesTheMeshThatItWasOpenedWith) {
  InProcessServer server;
  server.keeps_something();
  Client client = connect(server);
  const Mesh mesh = test::tet_ball();
  Session session = client.open(mesh);
  const std::vector<Vec3d> whole = test::points(mesh);
  for (int step = 0; step < 3; ++step) {
    const std::vector<NodeId> nodes = {2, static_cast<NodeId>(step == 0 ? 5 : 4)};
    const std::vector<Vec3d> to = {{1, 2, 3}, {4, 5, 6}};
    const SmoothReport report = session.move(nodes, std::span<const Vec3d>(to));
    EXPECT_EQ(report.topology_reused, step > 0);
    EXPECT_EQ(server.fake().motion(), std::pair(nodes, whole));
    const auto moved = std::get<std::span<const Vec3d>>(session.positions());
    EXPECT_EQ(moved[6].x, whole[6].x + 1);  // as the fake moves it
  }
  EXPECT_EQ(server.fake().prepared(), 1);
  const std::vector<NodeId> nodes = {2, 5};
  const std::vector<Vec3d> to = {{1, 2, 3}, {4, 5, 6}};
  const std::vector<NodeId> twice = {2, 2};
  EXPECT_THROW(session.move(twice, std::span<const Vec3d>(whole).first(2)), InvalidMesh);
  JobInput others;
  others.prescribed.nodes = twice;
  EXPECT_THROW(session.move(nodes, std::span<const Vec3d>(to), {.method = Move{}}, {}, others),
               InvalidOption);
}

TEST(Topologies, AreDescribedAndDeletedByName) {
  InProcessServer server;
  server.keeps_something();
  Client client = connect(server);
  Mesh mesh = test::tet_ball();
  Session session = client.open(mesh);
  std::vector<Vec3d> positions = test::points(mesh);
  session.smooth(positions, {});

  const TopologyInfo info = client.get_topology(session.topology_name());
  EXPECT_EQ(info.name, session.topology_name());
  EXPECT_EQ(info.node_count, static_cast<std::int64_t>(mesh.node_count()));
  EXPECT_EQ(info.element_count, static_cast<std::int64_t>(mesh.element_count()));
  EXPECT_GT(info.resident_bytes, 0);

  client.delete_topology(session.topology_name());
  try {
    (void)client.get_topology(session.topology_name());
    FAIL() << "it is still there";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "TOPOLOGY_NOT_FOUND");
    EXPECT_EQ(error.code(), StatusCode::not_found);
  }
  // The next step sends it once more.
  EXPECT_FALSE(session.smooth(positions, {}).topology_reused);
}

TEST(Session, RefusesAnotherNumberOfPositions) {
  InProcessServer server;
  Client client = connect(server);
  Session session = client.open(test::tet_ball());
  std::vector<Vec3d> positions(6);
  EXPECT_THROW(session.smooth(positions, {}), ServiceError);
}

std::string route_of(const grpc::ServerContext& context) {
  const auto found = context.client_metadata().find("meshsmooth-topology");
  return found == context.client_metadata().end()
             ? ""
             : std::string(found->second.data(), found->second.size());
}

// A proxy sends the steps of one mesh to one server, until that one says that it cannot.
TEST(Session, TellsProxiesItsTopologyUntilTheServerRefuses) {
  MockServer server;
  std::vector<std::string> routes;
  server.service.on_smooth = [&](grpc::ServerContext& context, ServerStream& stream) {
    routes.push_back(route_of(context));
    testing::read_spec(stream);
    testing::stop_sending(stream);
    testing::read_upload(stream);
    if (routes.size() % 2 == 0) return testing::refusal(grpc::StatusCode::INTERNAL, "WHY", "");
    return testing::refusal(grpc::StatusCode::UNAVAILABLE, "DRAINING", "", {},
                            std::chrono::nanoseconds(0));
  };
  Client client(server.address());
  Session session = client.open(test::tet_ball());
  std::vector<Vec3d> positions(7);
  for (int step = 0; step < 2; ++step) EXPECT_THROW(session.smooth(positions, {}), ServiceError);

  const std::string hash = session.topology_name().substr(sizeof "topologies/sha256");
  EXPECT_EQ(hash.size(), 64U);
  EXPECT_EQ(routes, (std::vector<std::string>{hash, "", hash, ""}));
}

// A server that starts anew, evicts or never had it: the mesh goes once more.
TEST(Session, SendsTheTopologyOnceToWhoeverDoesNotHaveIt) {
  MockServer server;
  std::vector<v1::JobSpec> specs;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    specs.push_back(testing::read_spec(stream));
    if (specs.size() == 1 || specs.size() == 4) {
      testing::stop_sending(stream);
      testing::read_upload(stream);
      return testing::refusal(grpc::StatusCode::NOT_FOUND, "TOPOLOGY_NOT_FOUND", "gone");
    }
    testing::accept(stream);
    const testing::Upload upload = testing::read_upload(stream);
    EXPECT_EQ(upload.elements.empty(), specs.back().has_topology_name());
    testing::send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
    testing::send_chunk(stream, 0, upload.coordinates);
    testing::send_summary(stream);
    return grpc::Status::OK;
  };
  const Mesh mesh = test::tet_ball();
  Client client(server.address());
  Session session = client.open(mesh);
  std::vector<Vec3d> positions = test::points(mesh);

  for (int step = 0; step < 3; ++step) session.smooth(positions, {});

  ASSERT_EQ(specs.size(), 5U);
  for (const int named : {0, 2, 3}) {
    EXPECT_EQ(specs[static_cast<std::size_t>(named)].topology_name(), session.topology_name());
  }
  for (const int whole : {1, 4}) {
    EXPECT_TRUE(specs[static_cast<std::size_t>(whole)].has_inline_topology());
    EXPECT_TRUE(specs[static_cast<std::size_t>(whole)].topology_kept());
  }
}

TEST(Session, KeepsToItsTimeoutWhenItSendsTheMeshAfterAll) {
  MockServer server;
  std::vector<std::chrono::system_clock::time_point> deadlines;
  server.service.on_smooth = [&](grpc::ServerContext& context, ServerStream& stream) {
    deadlines.push_back(context.deadline());
    testing::read_spec(stream);
    testing::stop_sending(stream);
    testing::read_upload(stream);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    return testing::refusal(grpc::StatusCode::NOT_FOUND, "TOPOLOGY_NOT_FOUND", "gone");
  };
  Client client(server.address());
  Session session = client.open(test::tet_ball());
  std::vector<Vec3d> positions(7);
  RequestOptions request;
  request.timeout = std::chrono::seconds(9);  // longer ones are rounded to seconds on the wire

  EXPECT_THROW(session.smooth(positions, {}, request), ServiceError);
  ASSERT_EQ(deadlines.size(), 2U);
  EXPECT_LT(deadlines[1], deadlines[0] + std::chrono::milliseconds(400));
}

TEST(Session, GivesUpWhenTheServerCannotKeepAnything) {
  MockServer server;
  int count = 0;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    ++count;
    testing::read_spec(stream);
    testing::stop_sending(stream);
    testing::read_upload(stream);
    return testing::refusal(grpc::StatusCode::NOT_FOUND, "TOPOLOGY_NOT_FOUND", "gone");
  };
  Client client(server.address());
  Session session = client.open(test::tet_ball());
  std::vector<Vec3d> positions(7);

  EXPECT_THROW(session.smooth(positions, {}), ServiceError);
  EXPECT_EQ(count, 2);
}

// The promise: same request, same bits, whatever the cache holds.
TEST(Session, HasTheSameBitsWhateverTheServerHas) {
  server::ServerConfig config = testing::quiet_config();
  config.backend = "cpu";
  config.lanes = 2;
  server::Server server(config);
  server.start();
  Client client = ClientAccess::make(server.in_process_channel());
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 8), 0.1, 1);
  SmoothOptions options;
  options.method = SmartLaplacian{};
  options.max_iterations = 30;
  options.history = true;

  const auto smooth = [&](Session& session) {
    std::vector<Vec3d> positions = test::points(mesh);
    const SmoothReport report = session.smooth(positions, options);
    return std::pair(positions, report.summary.convergence.rms_displacements);
  };
  Session session = client.open(mesh);
  const auto on_a_miss = smooth(session);
  EXPECT_EQ(smooth(session), on_a_miss);
  // Prepared for other positions first.
  server::Server other(config);
  other.start();
  Client other_client = ClientAccess::make(other.in_process_channel());
  Session elsewhere = other_client.open(mesh);
  std::vector<Vec3d> others = test::points(test::noisy(mesh, 0.1, 2));
  elsewhere.smooth(others, options);
  EXPECT_EQ(smooth(elsewhere), on_a_miss);
}

}  // namespace
}  // namespace meshsmooth::client
