// Clients whose uploads stall or trickle: what they can take from everybody else.
#include <gtest/gtest.h>

#include <chrono>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "meshsmooth/client.hpp"
#include "network/large_mesh.hpp"
#include "server/smooth_call.hpp"
#include "support/process.hpp"
#include "support/relay.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kMiB = 1 << 20;

/// A job of so many tetrahedra, whose nodes are 16 bytes each: 2 MiB and 16 MiB.
constexpr std::int64_t kModerate = kMiB / 8, kLarge = kMiB;
v1::JobSpec spec_of(std::int64_t element_count) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(element_count);
  return spec;
}

/// Anonymous calls over some connections, each of which sends 1 MiB of its mesh and stops.
class StalledUploads {
 public:
  StalledUploads(const ServerProgram& server, int count, std::int64_t element_count,
                 std::size_t connections = 2) {
    while (stubs_.size() < connections) stubs_.push_back(std::make_unique<Stub>(server.connect()));
    for (int i = 0; i < count; ++i) {
      SmoothCall& call = calls_.emplace_back(*stubs_[static_cast<std::size_t>(i) % connections]);
      call.send(spec_of(element_count));
    }
    for (SmoothCall& call : calls_) {
      const auto response = call.read();
      if (!response || !response->has_accepted()) continue;
      ++accepted_;
      call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, std::string(kMiB, '\0')));
    }
  }
  [[nodiscard]] int accepted() const { return accepted_; }

 private:
  std::vector<std::unique_ptr<Stub>> stubs_;
  std::list<SmoothCall> calls_;
  int accepted_ = 0;
};

/// How long the small job of somebody else takes, over a new connection.
Clock::duration time_of_small_job(const ServerProgram& server) {
  client::Client client(server.target());
  Mesh mesh = mesh_of_bytes(10'000);
  client::RequestOptions request;
  request.timeout = 30s;
  const auto begin = Clock::now();
  client.smooth(mesh, {}, request);
  return Clock::now() - begin;
}

int jobs_receiving(Stub& stub) {
  v1::ListJobsRequest request;
  request.add_states(v1::STATE_RECEIVING);
  request.set_page_size(1000);
  return list_jobs(stub, request).jobs_size();
}

TEST(StalledUploadsTest, DoNotLockOutStrangersWithDefaultSettings) {
  const ServerProgram server(0, {"--host-memory-limit-bytes", "0"});
  Stub stub(server.connect());
  time_of_small_job(server);  // the first pays for what is loaded once

  const StalledUploads stalled(server, 150, kModerate);
  EXPECT_GT(jobs_receiving(stub), 100);  // more than the queue has places

  EXPECT_LE(time_of_small_job(server), 1s);
}

TEST(StalledUploadsTest, LeaveMemoryToStrangersWhereAllOfThemDoNotFit) {
  const ServerProgram server;  // with 2 GiB, of which each connection gets a quarter
  Stub stub(server.connect());
  time_of_small_job(server);

  const StalledUploads stalled(server, 150, kLarge);
  EXPECT_LT(stalled.accepted(), 150);
  EXPECT_GT(stalled.accepted(), 2);

  EXPECT_LE(server_info(stub).backends(0).reserved_bytes(), 1024 * kMiB);
  EXPECT_LE(time_of_small_job(server), 1s);
}

// Callers without credentials are told apart by their connections, and one can open many.
TEST(StalledUploadsTest, GiveTheirMemoryUpWhereSomebodyFindsNone) {
  const ServerProgram server;
  Stub stub(server.connect());
  time_of_small_job(server);

  const StalledUploads large(server, 150, kLarge, 10);
  const StalledUploads rest(server, 20, kModerate / 2, 10);  // no room for a small job either
  EXPECT_GT(server_info(stub).backends(0).reserved_bytes(), (2048 - 17) * kMiB);
  const auto begin = Clock::now();
  EXPECT_TRUE(eventually([&] {
    try {
      time_of_small_job(server);
      return true;
    } catch (const client::ServiceError& error) {
      EXPECT_EQ(error.reason(), "HOST_MEMORY_BUSY");
      return false;
    }
  }));
  EXPECT_LE(Clock::now() - begin, 6s);
  EXPECT_LE(time_of_small_job(server), 1s);
}

TEST(StalledUploadsTest, ThatTrickleAreEndedByName) {
  const ServerProgram server(
      0, {"--min-upload-bytes-per-second", "1GiB", "--upload-rate-window-seconds", "0.2"});
  Stub stub(server.connect());
  SmoothCall call(stub);
  call.send(spec_of(kLarge));
  call.read_accepted();
  // Byte by byte, as fast as it goes: never idle, and still too slow.
  for (std::int64_t i = 0; call.send(chunk(v1::ARRAY_ID_ELEMENTS, i, "x")); ++i) {
    if (i % 1000 == 0 && jobs_receiving(stub) == 0) break;
  }

  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(call.details().reason, "UPLOAD_TOO_SLOW");
  expect_nothing_reserved(stub);
}

TEST(StalledUploadsTest, ThatStopAreEndedByName) {
  const ServerProgram server(0, {"--upload-rate-window-seconds", "0.2"});
  Stub stub(server.connect());
  SmoothCall call(stub);
  call.send(spec_of(kLarge));
  call.read_accepted();

  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(call.details().reason, "UPLOAD_TOO_SLOW");
  expect_nothing_reserved(stub);
}

// Over a line that takes several windows for the mesh.
TEST(StalledUploadsTest, AreNotWhatIsSlowButAboveTheRate) {
  const ServerProgram server(0, {"--min-upload-bytes-per-second", "256KiB",
                                 "--upload-rate-window-seconds", "5", "--max-queued-jobs", "1"});
  Relay relay(server.port());
  relay.slow_down_up(2 * kMiB);
  client::Client client(relay.target());
  Mesh mesh = mesh_of_bytes(12 * kMiB);
  SmoothOptions options;
  options.max_iterations = 1;
  const auto begin = Clock::now();

  EXPECT_NO_THROW(client.smooth(mesh, options, {}));

  EXPECT_GT(Clock::now() - begin, 5s);
}

}  // namespace
}  // namespace meshsmooth::testing
