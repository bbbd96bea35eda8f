// The service on a CUDA device: several lanes under load answer as a smoother alone
// does, and let go of what they held.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <iostream>
#include <mutex>
#include <random>
#include <set>
#include <stop_token>
#include <thread>

#include "client_access.hpp"
#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "meshsmooth/staging_memory.hpp"
#include "server/smooth_call.hpp"
#include "support/cuda_device.hpp"
#include "support/in_process_server.hpp"
#include "support/mesh_size.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth {
namespace {

using namespace std::chrono_literals;
using client::ServiceError;
using client::StatusCode;
using Clock = std::chrono::steady_clock;

constexpr double kPromptSeconds = 0.1;
constexpr std::int64_t kGiB = std::int64_t{1} << 30;

server::ServerConfig cuda_config(int lanes) {
  server::ServerConfig config = testing::quiet_config();
  config.backend = "cuda";
  config.lanes = lanes;
  // A number only: these tests refuse for the device's memory.
  config.host_memory_limit_bytes = 1024 * kGiB;
  return config;
}

/// A started server on a device, and ways to it.
class CudaServer {
 public:
  explicit CudaServer(const server::ServerConfig& config) : server_(config) { server_.start(); }

  [[nodiscard]] client::Client client() {
    return client::ClientAccess::make(server_.in_process_channel());
  }
  [[nodiscard]] testing::Stub stub() { return testing::Stub(server_.in_process_channel()); }

 private:
  server::Server server_;
};

// --- what is smoothed -----------------------------------------------------------

struct Case {
  std::string name;
  Mesh mesh;
  SmoothOptions options;
  Mesh expected = {};  // of a smoother alone
};

SmoothOptions guarded(const Method& method, Form form, int sweeps) {
  return {.method = method, .form = form, .max_iterations = sweeps, .tolerance = {1e-4}};
}

/// From 1,000 to 100,000 nodes, every method, volumes and surfaces; each in both
/// precisions.
std::vector<Case> mixed_cases() {
  using test::lattice;
  using test::noisy;
  std::vector<Case> cases = {
      {"tetrahedra_1k", noisy(lattice(ElementType::tetrahedron, 9), 0.15, 1),
       guarded(SmartLaplacian{}, Form::automatic, 50)},
      {"tetrahedra_5k", noisy(lattice(ElementType::tetrahedron, 16), 0.15, 2),
       test::sweeps(30, Laplacian{})},
      {"hexahedra_4k", noisy(lattice(ElementType::hexahedron, 15), 0.15, 3),
       guarded(Laplacian{.weighting = Weighting::inverse_edge_length}, Form::gauss_seidel, 40)},
      {"sphere_10k", noisy(test::sphere(5), 0.01, 4), guarded(Taubin{}, Form::jacobi, 30)},
      {"triangles_25k", noisy(lattice(ElementType::triangle, 160), 0.15, 5),
       guarded(HcLaplacian{}, Form::jacobi, 20)},
      {"mixed_7k", test::with_mask(noisy(test::mixed_stack(40), 0.1, 6)),
       guarded(SmartLaplacian{.weighting = Weighting::ball_volume, .relaxation = 0.7},
               Form::gauss_seidel, 20)},
      {"tangled_2k", noisy(lattice(ElementType::tetrahedron, 12), 0.45, 7),
       guarded(SmartLaplacian{}, Form::automatic, 50)},
      {"tetrahedra_100k", noisy(lattice(ElementType::tetrahedron, 45), 0.15, 8),
       guarded(Laplacian{}, Form::jacobi, 30)},
  };
  const std::size_t in_double = cases.size();
  for (std::size_t c = 0; c < in_double; ++c) {
    cases.push_back(
        {cases[c].name + "_float32", test::as_float32(cases[c].mesh), cases[c].options});
  }
  return cases;
}

/// Three million tetrahedra whose nodes take tens of thousands of sweeps to rest.
const Mesh& large_mesh() {
  static const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 79), 0.1, 1);
  return mesh;
}

SmoothOptions endless() { return test::sweeps(1'000'000'000, Laplacian{.relaxation = 0.25}); }

/// A spec whose arrays nobody sends: a billion tetrahedra.
v1::JobSpec too_large_spec() {
  v1::JobSpec spec;
  v1::TopologySpec* const topology = spec.mutable_inline_topology();
  topology->set_node_count(170'000'000);
  topology->add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
  topology->mutable_element_blocks(0)->set_element_count(1'000'000'000);
  spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
  spec.mutable_options()->mutable_smart_laplacian();
  return spec;
}

v1::JobSpec spec_of(const Mesh& mesh, const SmoothOptions& options) {
  v1::JobSpec spec;
  const MeshTopology topology(mesh);
  *spec.mutable_inline_topology() = wire::encode_topology_spec(topology.view());
  spec.set_coordinate_type(mesh.positions.index() == 1 ? v1::SCALAR_TYPE_FLOAT64
                                                       : v1::SCALAR_TYPE_FLOAT32);
  *spec.mutable_options() = wire::encode_options(options);
  return spec;
}

void send_array(testing::SmoothCall& call, v1::ArrayId id, const std::string& bytes) {
  constexpr std::size_t kChunkBytes = 1 << 20;
  for (std::size_t at = 0; at < bytes.size(); at += kChunkBytes) {
    call.send(testing::chunk(id, static_cast<std::int64_t>(at), bytes.substr(at, kChunkBytes)));
  }
}

void send_arrays(testing::SmoothCall& call, const Mesh& mesh) {
  std::string elements;
  for (const ElementBlock& block : mesh.blocks) elements += testing::bytes_of(block.nodes);
  send_array(call, v1::ARRAY_ID_ELEMENTS, elements);
  send_array(call, v1::ARRAY_ID_FIXED_MASK, testing::bytes_of(mesh.fixed));
  send_array(call, v1::ARRAY_ID_COORDINATES,
             std::visit([](const auto& p) { return testing::bytes_of(p); }, mesh.positions));
  call.half_close();
}

/// A call in a thread of its own whose job does not end by itself.
class EndlessCall {
 public:
  EndlessCall(CudaServer& server, const Mesh& mesh,
              client::RequestOptions request = client::RequestOptions())
      : client_(server.client()), mesh_(mesh) {
    request.stop = source_.get_token();
    request.progress_interval = 10ms;
    request.on_progress = [this](const client::JobProgress& progress) {
      const std::lock_guard lock(mutex_);
      progress_ = progress;
      changed_.notify_all();
    };
    thread_ = std::thread([this, request] {
      std::string reason = "ended by itself";
      try {
        client_.smooth(mesh_, endless(), request);
      } catch (const ServiceError& error) {
        reason = error.reason().empty() ? error.what() : error.reason();
        code_ = error.code();
      }
      const std::lock_guard lock(mutex_);
      reason_ = std::move(reason);
      ended_ = true;
      changed_.notify_all();
    });
  }
  EndlessCall(const EndlessCall&) = delete;
  EndlessCall& operator=(const EndlessCall&) = delete;
  ~EndlessCall() {
    source_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  /// False when the call ended instead.
  [[nodiscard]] bool wait_for_sweeps() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || progress_.iteration > 0; });
    return !ended_;
  }
  void cancel() { source_.request_stop(); }
  /// Why it ended.
  std::string end() {
    if (thread_.joinable()) thread_.join();
    return reason_;
  }
  [[nodiscard]] std::optional<StatusCode> code() const { return code_; }

 private:
  client::Client client_;
  Mesh mesh_;
  std::stop_source source_;
  std::mutex mutex_;
  std::condition_variable changed_;
  client::JobProgress progress_;
  bool ended_ = false;
  std::string reason_;
  std::optional<StatusCode> code_;
  std::thread thread_;
};

/// The name of the one job that runs.
std::string running_job(client::Client& client) {
  for (const client::JobInfo& job : client.list_jobs()) {
    if (job.state == client::JobState::running) return job.name;
  }
  return "";
}

class CudaService : public test::CudaTest {};

// --- load -----------------------------------------------------------------------

/// Cancels, deadlines and refusals beside the work.
class Disturbance {
 public:
  explicit Disturbance(CudaServer& server) : server_(server), thread_([this] { run(); }) {}
  Disturbance(const Disturbance&) = delete;
  Disturbance& operator=(const Disturbance&) = delete;
  ~Disturbance() { stop(); }

  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] int round_count() const { return round_count_; }

 private:
  void run() {
    while (!stopping_) {
      cancel_in_mid_iteration();
      let_a_deadline_pass();
      refuse_a_large_one();
      ++round_count_;
    }
  }
  void cancel_in_mid_iteration() {
    EndlessCall call(server_, large_mesh());
    EXPECT_TRUE(call.wait_for_sweeps()) << call.end();
    call.cancel();
    call.end();
    EXPECT_EQ(call.code(), StatusCode::cancelled);
  }
  void let_a_deadline_pass() {
    client::RequestOptions request;
    request.timeout = 300ms;
    EndlessCall call(server_, large_mesh(), request);
    call.end();
    EXPECT_EQ(call.code(), StatusCode::deadline_exceeded);
  }
  void refuse_a_large_one() {
    testing::Stub stub = server_.stub();
    testing::SmoothCall call(stub);
    call.send(too_large_spec());
    EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
  }

  CudaServer& server_;
  std::atomic<bool> stopping_ = false;
  std::atomic<int> round_count_ = 0;
  std::thread thread_;
};

class CudaServiceUnderLoad : public test::CudaTest, public ::testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Lanes, CudaServiceUnderLoad, ::testing::Values(1, 4, 8));

TEST_P(CudaServiceUnderLoad, AnswersAsASmootherAloneDoes) {
  std::vector<Case> cases = mixed_cases();
  {
    const std::unique_ptr<Smoother> cuda = make_smoother("cuda");
    const std::unique_ptr<Smoother> cpu = make_smoother("cpu");
    for (Case& one : cases) {
      one.expected = one.mesh;
      cuda->smooth(one.expected, one.options);
      Mesh on_cpu = one.mesh;
      cpu->smooth(on_cpu, one.options);
      EXPECT_TRUE(test::same_bits(one.expected, on_cpu)) << one.name;
    }
  }
  server::ServerConfig config = cuda_config(GetParam());
  // Enough for all that run at once, not for a billion tetrahedra.
  config.device_bytes = 16 * kGiB;
  config.devices = "all";
  CudaServer server(config);
  Disturbance disturbance(server);

  constexpr unsigned kClients = 6;
  constexpr int kRounds = 3;
  std::atomic<int> answer_count = 0, progress_count = 0;
  std::mutex mutex;
  std::set<std::string> devices;  // that answered
  std::vector<std::thread> clients;
  for (unsigned c = 0; c < kClients; ++c) {
    clients.emplace_back([&, c] {
      client::Client client = server.client();
      client::RequestOptions request;
      request.progress_interval = 10ms;
      request.on_progress = [&](const client::JobProgress&) { ++progress_count; };
      std::mt19937 random(c);
      std::vector<const Case*> order;
      for (const Case& one : cases) order.push_back(&one);
      for (int round = 0; round < kRounds; ++round) {
        std::shuffle(order.begin(), order.end(), random);
        for (const Case* one : order) {
          Mesh mesh = one->mesh;
          try {
            const client::SmoothReport report = client.smooth(mesh, one->options, request);
            EXPECT_TRUE(test::same_bits(mesh, one->expected)) << one->name;
            ++answer_count;
            const std::lock_guard lock(mutex);
            devices.insert(report.summary.backend);
          } catch (const Error& error) {
            ADD_FAILURE() << one->name << ": " << error.reason() << ": " << error.what();
          }
        }
      }
    });
  }
  for (std::thread& one : clients) one.join();
  disturbance.stop();

  EXPECT_EQ(answer_count, static_cast<int>(kClients * kRounds * cases.size()));
  EXPECT_GT(progress_count, answer_count.load());
  EXPECT_GT(disturbance.round_count(), 0);
  testing::Stub stub = server.stub();
  testing::expect_nothing_reserved(stub);
  std::set<std::string> expected;
  for (const BackendInfo& info : list_backends()) {
    if (info.available && info.name.starts_with("cuda:")) expected.insert(info.name);
  }
  EXPECT_EQ(devices, expected);
  const v1::GetServerInfoResponse info = testing::server_info(stub);
  for (const v1::Backend& backend : info.backends()) EXPECT_TRUE(backend.healthy());
}

// --- stopping -------------------------------------------------------------------

enum class Way { by_client, by_job_call };

class CudaServicePromptly : public test::CudaTest, public ::testing::WithParamInterface<Way> {};
INSTANTIATE_TEST_SUITE_P(Cancelled, CudaServicePromptly,
                         ::testing::Values(Way::by_client, Way::by_job_call));

TEST_P(CudaServicePromptly, EndsAJobInMidIterationAndTakesTheNext) {
  CudaServer server(cuda_config(1));
  client::Client client = server.client();
  const Mesh next = test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.15, 1);
  Mesh expected = next;
  make_smoother("cuda")->smooth(expected, SmoothOptions{.method = SmartLaplacian{}});
  for (int repeat = 0; repeat < 3; ++repeat) {
    EndlessCall call(server, large_mesh());
    ASSERT_TRUE(call.wait_for_sweeps()) << call.end();
    const std::string name = running_job(client);
    ASSERT_FALSE(name.empty());

    const auto begin = Clock::now();
    if (GetParam() == Way::by_client) {
      call.cancel();
    } else {
      client.cancel_job(name);
    }
    // Only the lane ends a running job.
    while (client.get_job(name).state == client::JobState::running) std::this_thread::yield();
    const std::chrono::duration<double> elapsed = Clock::now() - begin;

    EXPECT_LT(elapsed.count(), kPromptSeconds);
    EXPECT_EQ(client.get_job(name).state, client::JobState::cancelled);
    call.end();
    EXPECT_EQ(call.code(), StatusCode::cancelled);
    Mesh mesh = next;
    client.smooth(mesh, SmoothOptions{.method = SmartLaplacian{}});
    EXPECT_TRUE(test::same_bits(mesh, expected));
    std::cout << "cancelled in " << elapsed.count() * 1e3 << " ms" << std::endl;
  }
  testing::Stub stub = server.stub();
  testing::expect_nothing_reserved(stub);
}

TEST_F(CudaService, ReturnsWhatIsReachedWhenAskedToFinishEarly) {
  CudaServer server(cuda_config(1));
  client::Client client = server.client();
  EndlessCall call(server, large_mesh());
  ASSERT_TRUE(call.wait_for_sweeps()) << call.end();

  client.cancel_job(running_job(client), true);

  EXPECT_EQ(call.end(), "ended by itself");
}

TEST_F(CudaService, ReturnsTheQualityOfEachElementThatASmootherAloneFinds) {
  CudaServer server(cuda_config(2));
  client::Client client = server.client();
  SmoothOptions options = guarded(SmartLaplacian{}, Form::automatic, 20);
  options.element_quality_metrics.assign(kQualityMetrics.begin(), kQualityMetrics.end());
  Mesh mesh = test::noisy(test::mixed_stack(40), 0.1, 6);
  Mesh alone = mesh;
  const ElementQualityArrays expected =
      make_smoother("cuda")->smooth(alone, options).element_quality;

  const ElementQualityArrays found = client.smooth(mesh, options).summary.element_quality;

  EXPECT_EQ(found.metrics, expected.metrics);
  ASSERT_EQ(found.values.size(), expected.values.size());
  // Bits, for not every value is a number.
  EXPECT_EQ(std::memcmp(found.values.data(), expected.values.data(),
                        std::as_bytes(std::span(found.values)).size()),
            0);
  testing::Stub stub = server.stub();
  testing::expect_nothing_reserved(stub);
}

// --- the device's memory ----------------------------------------------------------

TEST_F(CudaService, RefusesAMeshThatTheDeviceCannotHoldBeforeItsData) {
  server::ServerConfig config = cuda_config(1);
  CudaServer server(config);
  testing::Stub stub = server.stub();
  const std::int64_t limit = testing::server_info(stub).backends(0).total_bytes();
  v1::JobSpec spec = too_large_spec();
  spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(2'000'000'000);
  spec.mutable_inline_topology()->set_node_count(2'000'000'000);
  testing::SmoothCall call(stub);

  call.send(spec);

  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
  EXPECT_EQ(call.detail("space"), "device");
  EXPECT_EQ(call.detail("limit_bytes"), std::to_string(limit));
  EXPECT_GT(std::stoll(call.detail("need_bytes")), limit);
  EXPECT_TRUE(call.was_told_to_stop());
  EXPECT_FALSE(call.details().retry_delay.has_value());
}

TEST_F(CudaService, RefusesForNowWhatDoesNotFitBesideOthers) {
  const Mesh small = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.15, 1);
  const std::int64_t need =
      make_smoother("cuda")->estimate(test::size_of(large_mesh()), endless()).device_bytes;
  server::ServerConfig config = cuda_config(2);
  config.device_bytes = need + 1;
  CudaServer server(config);
  client::Client client = server.client();
  {
    EndlessCall call(server, large_mesh());
    ASSERT_TRUE(call.wait_for_sweeps()) << call.end();
    Mesh mesh = small;
    client::RequestOptions once;
    once.max_attempts = 1;  // or the client would wait until the other has ended
    try {
      client.smooth(mesh, SmoothOptions{.method = SmartLaplacian{}}, once);
      ADD_FAILURE() << "not refused";
    } catch (const ServiceError& error) {
      EXPECT_EQ(error.code(), StatusCode::resource_exhausted);
      EXPECT_EQ(error.reason(), "DEVICE_MEMORY_BUSY");
    }
  }
  testing::Stub stub = server.stub();
  testing::expect_nothing_reserved(stub);
  Mesh mesh = small;
  EXPECT_GT(client.smooth(mesh, SmoothOptions{.method = SmartLaplacian{}}).summary.nodes.moved, 0);
}

TEST_F(CudaService, ReservesWhatAJobTakesAndAtMostAFifthMore) {
  CudaServer server(cuda_config(2));
  testing::Stub stub = server.stub();
  for (const Case& one : mixed_cases()) {
    if (one.mesh.element_count() < 100'000) continue;
    SCOPED_TRACE(one.name);
    testing::SmoothCall call(stub);
    call.send(spec_of(one.mesh, one.options));
    const auto accepted = call.read();
    ASSERT_TRUE(accepted && accepted->has_accepted());
    const auto reserved = static_cast<double>(accepted->accepted().device_reserved_bytes());
    EXPECT_EQ(testing::server_info(stub).backends(0).reserved_bytes(),
              accepted->accepted().device_reserved_bytes());
    send_arrays(call, one.mesh);

    ASSERT_TRUE(call.finish().ok()) << call.finish().error_message();

    const auto peak = static_cast<double>(call.summary()->execution().device_peak_bytes());
    EXPECT_GE(reserved, peak);
    EXPECT_LE(reserved, 1.2 * peak);
    EXPECT_GT(call.summary()->execution().host_peak_bytes(), 0);
    testing::expect_nothing_reserved(stub);
  }
}

// --- kept topologies ----------------------------------------------------------------

TEST_F(CudaService, KeepsATopologyOnTheDeviceForTheStepsOfAMovingMesh) {
  CudaServer server(cuda_config(2));
  client::Client client = server.client();
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.15, 1);
  const MeshTopology topology(mesh);
  const auto smoother = make_smoother("cuda");
  const auto prepared = smoother->prepare(topology.view());
  client::Session session = client.open(mesh);
  for (int step = 0; step < 3; ++step) {
    SCOPED_TRACE(step);
    Mesh expected = test::noisy(mesh, 0.01, static_cast<unsigned>(step + 2));
    Mesh now = expected;
    (void)smoother->smooth(*prepared, expected.positions_span(), {}, {});
    const client::SmoothReport report = session.smooth(std::span(test::points(now)), {});
    EXPECT_TRUE(test::same_bits(now, expected));
    EXPECT_EQ(report.topology_reused, step > 0);
  }
  testing::Stub stub = server.stub();
  EXPECT_EQ(testing::server_info(stub).backends(0).reserved_bytes(),
            prepared->bytes().device_bytes);
  client.delete_topology(session.topology_name());
  testing::expect_nothing_reserved(stub);
}

TEST_F(CudaService, DropsKeptTopologiesBeforeItRefusesAJob) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.15, 1);
  const MeshTopology topology(mesh);
  const auto smoother = make_smoother("cuda");
  const std::int64_t kept = smoother->prepare(topology.view())->bytes().device_bytes;
  server::ServerConfig config = cuda_config(1);
  config.device_bytes = smoother->estimate(test::size_of(mesh), {}).device_bytes + 2 * kept;
  CudaServer server(config);
  client::Client client = server.client();
  for (std::size_t n = 0; n < 6; ++n) {
    SCOPED_TRACE(n);
    Mesh other = mesh;  // another topology each time
    other.fixed.assign(mesh.node_count(), 0);
    other.fixed[mesh.node_count() / 2 + n] = 1;
    client::Session session = client.open(other);
    for (int step = 0; step < 2; ++step) {
      Mesh now = other;
      EXPECT_GT(session.smooth(std::span(test::points(now)), {}).summary.nodes.moved, 0);
    }
  }
  testing::Stub stub = server.stub();
  EXPECT_LE(testing::server_info(stub).backends(0).reserved_bytes(), 2 * kept + kept / 10);
}

// --- staging ----------------------------------------------------------------------

TEST_F(CudaService, LocksPagesOnceForManyMeshes) {
  const std::unique_ptr<StagingMemory> memory =
      make_staging_memory("cuda:0", std::size_t{64} << 20);
  ASSERT_NE(memory, nullptr);
  const std::size_t bytes = 9'500'000;
  void* const first = memory->allocate(bytes, 64);
  memory->deallocate(first, bytes, 64);

  EXPECT_EQ(memory->idle_bytes(), StagingMemory::block_bytes(bytes));
  void* const second = memory->allocate(bytes - 1000, 64);
  EXPECT_EQ(second, first);
  memory->deallocate(second, bytes - 1000, 64);
}

}  // namespace
}  // namespace meshsmooth
