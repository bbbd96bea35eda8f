// Meshes that travel through memory shared with the server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <optional>
#include <thread>

#include "meshsmooth/client.hpp"
#include "server/conservation.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"
#include "support/process.hpp"
#include "support/scratch_folder.hpp"
#include "transport/segment_pool.hpp"

namespace meshsmooth::client {
namespace {

using testing::eventually;
using testing::InProcessServer;
using testing::Stub;

/// Large enough not to go at once.
Mesh lattice(int cells = 16) { return test::lattice(ElementType::tetrahedron, cells); }

std::vector<Vec3d> moved(const Mesh& mesh) {
  auto positions = std::get<std::vector<Vec3d>>(mesh.positions);
  for (Vec3d& p : positions) p.x += 1;  // as the fake smoother does
  return positions;
}

SmoothOptions one_sweep() {
  SmoothOptions options;
  options.method = Laplacian{};
  options.max_iterations = 1;
  return options;
}

class ClientSharedMemoryTest : public ::testing::Test {
 protected:
  ClientSharedMemoryTest() { start(); }

  void start() {
    server::ServerConfig config = testing::quiet_config();
    config.listen = "unix:" + folder_.path("socket").string();
    server_.emplace(config);
  }
  [[nodiscard]] Client connect() const { return Client("unix:" + folder_.path("socket").string()); }

  /// Jobs until one goes through shared memory.
  static bool comes_to_share(Client& client) {
    return eventually([&] {
      Mesh mesh = lattice();
      const auto expected = moved(mesh);
      const SmoothReport report = client.smooth(mesh, one_sweep());
      EXPECT_EQ(std::get<std::vector<Vec3d>>(mesh.positions), expected);
      return report.shared_memory;
    });
  }

  const testing::ScratchFolder folder_;
  std::optional<InProcessServer> server_;
};

TEST_F(ClientSharedMemoryTest, SharesMemoryFromTheSecondJobOn) {
  Client client = connect();
  Mesh mesh = lattice();
  EXPECT_FALSE(client.smooth(mesh, one_sweep()).shared_memory);
  EXPECT_TRUE(comes_to_share(client));
}

TEST_F(ClientSharedMemoryTest, SendsAllArraysAndTakesTheQualityOfElements) {
  Client client = connect();
  ASSERT_TRUE(comes_to_share(client));
  Mesh mesh = lattice();
  mesh.blocks.push_back({ElementType::hexahedron, {0, 1, 2, 3, 4, 5, 6, 7}});
  mesh.fixed.assign(mesh.node_count(), 0);
  mesh.fixed[3] = 1;
  mesh.regions.assign(mesh.element_count(), 5);
  SmoothOptions options = one_sweep();
  options.element_quality_metrics = {QualityMetric::mean_ratio};
  Mesh in_chunks = mesh;
  RequestOptions unshared;
  unshared.shared_memory = false;
  const SmoothReport chunks = client.smooth(in_chunks, options, unshared);
  EXPECT_FALSE(chunks.shared_memory);
  std::optional<SmoothReport> shared;
  ASSERT_TRUE(eventually([&] {
    Mesh copy = mesh;
    shared = client.smooth(copy, options);
    EXPECT_EQ(copy.positions, in_chunks.positions);
    return shared->shared_memory;
  }));
  EXPECT_EQ(shared->summary.element_quality.values, chunks.summary.element_quality.values);
}

TEST_F(ClientSharedMemoryTest, SharesTheStepsOfASession) {
  server_->keeps_something();
  Client client = connect();
  const Mesh mesh = lattice();
  Session session = client.open(mesh);
  auto positions = std::get<std::vector<Vec3d>>(mesh.positions);
  ASSERT_TRUE(eventually([&] {
    const double before = positions[7].x;
    const SmoothReport report = session.smooth(positions, one_sweep());
    EXPECT_EQ(positions[7].x, before + 1);
    return report.shared_memory && report.topology_reused;
  }));
}

/// The positions of a session.
std::vector<Vec3d> positions_of(const Session& session) {
  const auto positions = std::get<std::span<const Vec3d>>(session.positions());
  return {positions.begin(), positions.end()};
}

/// Steps in place until one goes through shared memory; each moves all nodes by 1.
bool steps_in_it(Session& session) {
  return eventually([&] {
    const auto before = positions_of(session);
    const SmoothReport report = session.smooth(one_sweep());
    EXPECT_EQ(positions_of(session)[7].x, before[7].x + 1);
    return report.shared_memory;
  });
}

TEST_F(ClientSharedMemoryTest, ASessionsPositionsStayInTheSegment) {
  server_->keeps_something();
  Client client = connect();
  const Mesh mesh = lattice();
  Session session = client.open(mesh);
  EXPECT_EQ(positions_of(session), std::get<std::vector<Vec3d>>(mesh.positions));
  ASSERT_TRUE(steps_in_it(session));
  const Vec3d* last = nullptr;
  for (int step = 0; step < 5; ++step) {
    const auto positions = std::get<std::span<Vec3d>>(session.positions_span());
    EXPECT_NE(positions.data(), last);  // the result is not written over the input
    last = positions.data();
    for (Vec3d& p : positions) p.y = step;
    const double before = positions[7].x;

    EXPECT_TRUE(session.smooth(one_sweep()).shared_memory);

    EXPECT_EQ(positions_of(session)[7],
              (Vec3d{before + 1, static_cast<double>(step), std::get<1>(mesh.positions)[7].z}));
  }
}

TEST_F(ClientSharedMemoryTest, ASessionTakesStepsOfEveryKindInItsSegment) {
  server_->keeps_something();
  Client client = connect();
  const Mesh mesh = lattice();
  Session session = client.open(mesh);
  ASSERT_TRUE(steps_in_it(session));
  SmoothOptions with_quality = one_sweep();
  with_quality.element_quality_metrics = {QualityMetric::mean_ratio,
                                          QualityMetric::scaled_jacobian};
  const std::vector<NodeId> nodes = {0, 1};
  const auto start = std::get<std::vector<Vec3d>>(mesh.positions);
  std::vector<Vec3d> given = start;
  std::vector<Vec3f> floats;
  for (const Vec3d& p : start) floats.push_back(vec3_cast<float>(p));
  for (int round = 0; round < 6; ++round) {
    const double in_place = positions_of(session)[7].x;
    (void)session.smooth(round % 2 == 0 ? with_quality : one_sweep());
    EXPECT_EQ(positions_of(session)[7].x, in_place + 1);

    const double before = given[7].x;
    (void)session.smooth(std::span(given), one_sweep());
    EXPECT_EQ(given[7].x, before + 1);
    EXPECT_EQ(positions_of(session), given);

    (void)session.move(nodes, std::span(start).first(2));
    EXPECT_EQ(positions_of(session)[7].x, start[7].x + 1);

    if (round < 3) continue;
    const float single = floats[7].x;
    (void)session.smooth(std::span(floats), one_sweep());
    EXPECT_EQ(floats[7].x, single + 1);
    (void)session.move(nodes, std::span(start).first(2));
  }
}

TEST_F(ClientSharedMemoryTest, ASessionsPositionsOutliveAFailureAndTheServer) {
  server_->keeps_something();
  Client client = connect();
  const Mesh mesh = lattice();
  Session session = client.open(mesh);
  ASSERT_TRUE(steps_in_it(session));
  auto before = positions_of(session);
  server_->fake().fail_with([] { throw InvalidMesh("MESH_TANGLED", "tangled"); });
  EXPECT_THROW((void)session.smooth(one_sweep()), ServiceError);
  EXPECT_EQ(positions_of(session), before);
  server_->fake().fail_with({});
  ASSERT_TRUE(steps_in_it(session));

  before = positions_of(session);
  server_.reset();
  EXPECT_EQ(positions_of(session), before);
  start();
  server_->keeps_something();
  const SmoothReport report = session.smooth(one_sweep());
  EXPECT_FALSE(report.shared_memory);
  EXPECT_EQ(positions_of(session)[7].x, before[7].x + 1);
  EXPECT_TRUE(steps_in_it(session));
}

TEST_F(ClientSharedMemoryTest, ASessionReturnsItsSegment) {
  server_->keeps_something();
  Client client = connect();
  const Mesh mesh = lattice();
  {
    Session session = client.open(mesh);
    ASSERT_TRUE(steps_in_it(session));
  }
  EXPECT_TRUE(client.open(mesh).smooth(one_sweep()).shared_memory);
}

TEST_F(ClientSharedMemoryTest, NeedsNoSegmentForASmallMesh) {
  Client client = connect();
  for (int i = 0; i < 20; ++i) {
    Mesh small = lattice(2);
    EXPECT_FALSE(client.smooth(small, one_sweep()).shared_memory);
  }
}

TEST_F(ClientSharedMemoryTest, ReturnsItsSegmentsWhenItIsDestroyed) {
  Stub stub(server_->channel());
  testing::Conservation conservation(stub);
  for (int i = 0; i < 5; ++i) {
    Client client = connect();
    EXPECT_TRUE(comes_to_share(client));
  }
  conservation.check();
}

TEST_F(ClientSharedMemoryTest, TakesALargerSegmentForALargerMesh) {
  Client client = connect();
  ASSERT_TRUE(comes_to_share(client));
  EXPECT_TRUE(eventually([&] {
    Mesh larger = lattice(24);
    return client.smooth(larger, one_sweep()).shared_memory;
  }));
  Mesh mesh = lattice();
  EXPECT_TRUE(client.smooth(mesh, one_sweep()).shared_memory);  // there is room in it
}

TEST_F(ClientSharedMemoryTest, GoesOnInChunksWhenItsSegmentIsGone) {
  Client client = connect();
  ASSERT_TRUE(comes_to_share(client));
  server_->keeps_something();  // the client's segment
  server_.reset();
  start();
  Mesh mesh = lattice();
  const auto expected = moved(mesh);
  EXPECT_FALSE(client.smooth(mesh, one_sweep()).shared_memory);
  EXPECT_EQ(std::get<std::vector<Vec3d>>(mesh.positions), expected);
  EXPECT_TRUE(comes_to_share(client));
}

TEST_F(ClientSharedMemoryTest, LeavesTheMeshAloneWhenItsJobFails) {
  Client client = connect();
  ASSERT_TRUE(comes_to_share(client));
  server_->fake().fail_with([] { throw InvalidMesh("MESH_TANGLED", "tangled"); });
  Mesh mesh = lattice();
  const Mesh before = mesh;
  EXPECT_THROW(client.smooth(mesh, one_sweep()), ServiceError);
  EXPECT_EQ(mesh.positions, before.positions);
  server_->fake().fail_with({});
  EXPECT_TRUE(comes_to_share(client));
}

TEST_F(ClientSharedMemoryTest, GivesItsSegmentBackWhenTheServerWantsIt) {
  server_.reset();
  server::ServerConfig config = testing::quiet_config();
  config.listen = "unix:" + folder_.path("socket").string();
  config.shared_memory_idle_timeout = std::chrono::milliseconds(50);
  server_.emplace(config);
  Stub stub(server_->channel());
  Client client = connect();
  ASSERT_TRUE(comes_to_share(client));
  EXPECT_TRUE(
      eventually([&] { return testing::server_info(stub).backends(0).reserved_bytes() == 0; }));
  EXPECT_TRUE(comes_to_share(client));
}

TEST_F(ClientSharedMemoryTest, ServesManyThreads) {
  Client client = connect();
  std::atomic<int> shared = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 50; ++i) {
        Mesh mesh = lattice();
        const auto expected = moved(mesh);
        if (client.smooth(mesh, one_sweep()).shared_memory) ++shared;
        EXPECT_EQ(std::get<std::vector<Vec3d>>(mesh.positions), expected);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(shared, 0);
}

TEST_F(ClientSharedMemoryTest, HasNoneWhereTheServerSharesNone) {
  server_.reset();
  server::ServerConfig config = testing::quiet_config();
  config.listen = "unix:" + folder_.path("socket").string();
  config.shared_memory_socket = "";
  server_.emplace(config);
  Client client = connect();
  for (int i = 0; i < 10; ++i) {
    Mesh mesh = lattice();
    EXPECT_FALSE(client.smooth(mesh, one_sweep()).shared_memory);
  }
}

TEST_F(ClientSharedMemoryTest, IsNotKeptByAForkedChild) {
  // The server must see the end of a lease though a child of the caller lives on.
  const auto stub = v1::SmoothingService::NewStub(server_->channel());
  std::optional<SegmentPool> pool(std::in_place, *stub);
  EXPECT_TRUE(eventually([&] {
    SegmentPool::Borrowed segment = pool->borrow(1 << 20);
    const bool made = segment.get() != nullptr;
    segment.keep();
    return made;
  }));
  Stub service(server_->channel());
  const auto reserved = [&] { return testing::server_info(service).backends(0).reserved_bytes(); };
  EXPECT_GT(reserved(), 0);
  const pid_t child = fork();
  if (child == 0) {
    for (;;) pause();
  }
  pool.reset();
  EXPECT_TRUE(eventually([&] { return reserved() == 0; }));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

}  // namespace
}  // namespace meshsmooth::client
