// R16: whatever fails inside, and at whichever time, has its documented status; nothing stays
// behind, and the next job is answered.
#include <google/protobuf/util/time_util.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <functional>
#include <new>
#include <stdexcept>

#include "meshsmooth/error.hpp"
#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"
#include "support/sanitizer.hpp"
#include "support/server_program.hpp"
#include "wire/crc32c.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using namespace std::chrono_literals;

// --- the backend ---------------------------------------------------------------------

struct Failure {
  const char* name;
  std::function<void()> thrower;
  StatusCode code;
  const char* reason;
  bool retry;
};

std::string failure_name(const ::testing::TestParamInfo<Failure>& info) { return info.param.name; }

/// Throws at the n-th call of those to come.
std::function<void()> at_call(int n, const std::function<void()>& thrower) {
  return [=, left = std::make_shared<std::atomic<int>>(n)] {
    if (--*left == 0) thrower();
  };
}

class BackendFails : public ::testing::TestWithParam<Failure> {
 protected:
  /// How a job ends: all is well, or as the failure is documented; true of the latter.
  bool fails(const v1::JobSpec& spec) {
    SmoothCall call(stub_);
    call.send_all(mesh_, spec);
    if (call.finish().ok()) {
      EXPECT_EQ(call.result(), mesh_.moved());
      return false;
    }
    EXPECT_EQ(call.finish().error_code(), GetParam().code) << call.finish().error_message();
    EXPECT_EQ(call.details().reason, GetParam().reason);
    EXPECT_EQ(call.details().retry_delay.has_value(), GetParam().retry);
    EXPECT_TRUE(call.result().empty());
    return true;
  }

  /// Which of five jobs failed.
  std::vector<int> failing(const v1::JobSpec& spec) {
    std::vector<int> which;
    for (int job = 1; job <= 5; ++job) {
      if (fails(spec)) which.push_back(job);
    }
    return which;
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
};

TEST_P(BackendFails, AtTheNthJobAndOnlyThatOneFails) {
  Conservation conservation(stub_);
  for (int n = 1; n <= 5; ++n) {
    server_.fake().fail_with(at_call(n, GetParam().thrower));
    EXPECT_EQ(failing(TwoTetrahedra::spec()), std::vector<int>{n});
  }
  conservation.check();
}

// A topology that could not be prepared is prepared again by the next job that brings it.
TEST_P(BackendFails, AtTheNthPreparationAndOnlyThatJobFails) {
  Conservation conservation(stub_);
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_topology_kept(true);
  server_.fake().fail_to_prepare(at_call(1, GetParam().thrower));
  EXPECT_EQ(failing(spec), std::vector<int>{1});
  EXPECT_EQ(server_.fake().prepared(), 2);  // from then on it is there
  conservation.check(static_cast<std::int64_t>(mesh_.elements.size() + mesh_.fixed.size()));
  server_.keeps_something();
}

// The table of docs/protocol.md.
INSTANTIATE_TEST_SUITE_P(
    All, BackendFails,
    ::testing::Values(
        Failure{"Allocation", [] { throw std::bad_alloc(); }, StatusCode::RESOURCE_EXHAUSTED,
                "HOST_MEMORY_BUSY", true},
        Failure{"HostMemory", [] { throw OutOfMemory("HOST_MEMORY_EXHAUSTED", ""); },
                StatusCode::RESOURCE_EXHAUSTED, "HOST_MEMORY_EXHAUSTED", false},
        Failure{"DeviceMemory", [] { throw OutOfMemory("DEVICE_MEMORY_EXHAUSTED", ""); },
                StatusCode::RESOURCE_EXHAUSTED, "DEVICE_MEMORY_EXHAUSTED", false},
        Failure{"DeviceCall", [] { throw DeviceError("DEVICE_REFUSED", "", false); },
                StatusCode::UNAVAILABLE, "DEVICE_REFUSED", true},
        Failure{"Mesh", [] { throw InvalidMesh("FACET_OVERUSED", ""); },
                StatusCode::INVALID_ARGUMENT, "FACET_OVERUSED", false},
        Failure{"Deadline", [] { throw DeadlineExceeded("DEADLINE_RUNNING", ""); },
                StatusCode::DEADLINE_EXCEEDED, "DEADLINE_RUNNING", false},
        Failure{"Unforeseen", [] { throw std::logic_error("a bug"); }, StatusCode::INTERNAL,
                "INTERNAL", false},
        Failure{"NoException", [] { throw 42; }, StatusCode::INTERNAL, "INTERNAL", false}),
    failure_name);

// --- memory --------------------------------------------------------------------------

// The budget promises more than the system gives: as where other programs took it.
TEST(AllocationFails, TheJobIsRefusedAndTheServerGoesOn) {
  if (meshsmooth::testing::kAddressSanitizer) GTEST_SKIP() << "no limits under the sanitizer";
  ServerProgram server(0, {"--host-memory-limit-bytes", "1TiB", "--max-job-bytes", "1TiB"});
  Stub stub(server.connect());
  const rlimit limit{std::uint64_t{6} << 30, std::uint64_t{6} << 30};
  ASSERT_EQ(prlimit(server.process().id(), RLIMIT_AS, &limit, nullptr), 0);
  for (int i = 0; i < 3; ++i) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.mutable_inline_topology()->set_node_count(500'000'000);  // 12 GB
    SmoothCall call(stub);
    call.send(spec);
    EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED)
        << call.finish().error_message();
    EXPECT_EQ(call.details().reason, "HOST_MEMORY_BUSY");
    EXPECT_TRUE(call.details().retry_delay);
  }
  SmoothCall next(stub);
  next.send_all({});
  EXPECT_TRUE(next.finish().ok()) << next.finish().error_message();
  expect_nothing_reserved(stub);
  EXPECT_EQ(list_jobs(stub).jobs_size(), 1);
}

// Of many that reserve at once some do not fit; each byte of those comes back.
TEST(ReservationFails, AtEveryPlaceInARowOfJobs) {
  server::ServerConfig config = quiet_config();
  config.host_memory_limit_bytes = 200 << 20;
  InProcessServer server(config);
  Stub stub(server.channel());
  Conservation conservation(stub);
  const TwoTetrahedra mesh;
  for (int too_large = 0; too_large < 4; ++too_large) {
    for (int job = 0; job < 4; ++job) {
      const bool never = job == too_large;
      server.fake().set_estimate({.host_bytes = never ? 300 << 20 : 0, .device_bytes = 0});
      SmoothCall call(stub);
      call.send_all(mesh);
      EXPECT_EQ(call.finish().error_code(),
                never ? StatusCode::RESOURCE_EXHAUSTED : StatusCode::OK);
      if (never) {
        EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
      }
    }
  }
  // A call gives back what it held a little after its status has gone: several, in sequence after
  // the other, may still hold theirs.
  expect_nothing_reserved(stub);
  server.fake().set_estimate({.host_bytes = 60 << 20, .device_bytes = 0});
  SmoothCall first(stub), second(stub), third(stub);
  for (SmoothCall* call : {&first, &second}) {
    call->send(TwoTetrahedra::spec());
    call->read_accepted();
  }
  third.send(TwoTetrahedra::spec());
  EXPECT_EQ(third.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(third.details().reason, "HOST_MEMORY_BUSY");
  EXPECT_TRUE(third.details().retry_delay);
  for (SmoothCall* call : {&first, &second}) {
    call->send_data(mesh);
    call->half_close();  // else its status waits, and the next call is dropped meanwhile
    EXPECT_TRUE(call->finish().ok());
  }
  conservation.check();
}

// --- the data ------------------------------------------------------------------------

// Any one chunk of those that make the mesh.
TEST(ChecksumFails, InEveryChunk) {
  InProcessServer server;
  Stub stub(server.channel());
  Conservation conservation(stub);
  const TwoTetrahedra mesh;
  std::vector<v1::Chunk> chunks;
  const auto cut = [&](v1::ArrayId id, const std::string& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 8) {
      chunks.push_back(chunk(id, static_cast<std::int64_t>(at), bytes.substr(at, 8)));
    }
  };
  cut(v1::ARRAY_ID_ELEMENTS, mesh.elements);
  cut(v1::ARRAY_ID_FIXED_MASK, mesh.fixed);
  cut(v1::ARRAY_ID_COORDINATES, bytes_of(mesh.coordinates));
  for (std::size_t wrong = 0; wrong <= chunks.size(); ++wrong) {
    SmoothCall call(stub);
    call.send(TwoTetrahedra::spec());
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      v1::Chunk next = chunks[i];
      next.set_crc32c(wire::crc32c(std::as_bytes(std::span(next.data()))));
      if (i == wrong) next.mutable_data()->front() ^= 1;  // a bit that tipped on its way
      if (!call.send(std::move(next))) break;
    }
    call.half_close();
    if (wrong == chunks.size()) {
      EXPECT_TRUE(call.finish().ok());
      EXPECT_EQ(call.result(), mesh.moved());
      continue;
    }
    EXPECT_EQ(call.finish().error_code(), StatusCode::DATA_LOSS) << wrong;
    EXPECT_EQ(call.details().reason, "CHECKSUM_MISMATCH");
    EXPECT_EQ(call.detail("array"), v1::ArrayId_Name(chunks[wrong].array_id()));
    EXPECT_EQ(call.detail("offset_bytes"), std::to_string(chunks[wrong].offset_bytes()));
  }
  conservation.check();
}

// A name says the content: with one digit off there is no such topology, and nothing is kept
// of a mesh that did not arrive whole.
TEST(TopologyHashFails, InEveryDigit) {
  InProcessServer server;
  server.keeps_something();
  Stub stub(server.channel());
  const TwoTetrahedra mesh;
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_topology_kept(true);
  SmoothCall keeping(stub);
  keeping.send_all(mesh, spec);
  keeping.read_accepted();
  const auto header = keeping.read();
  ASSERT_TRUE(header && header->has_result());
  const std::string name = header->result().topology_name();
  EXPECT_TRUE(keeping.finish().ok());
  Conservation conservation(stub);

  v1::JobSpec named;
  named.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
  for (std::size_t digit = name.rfind('-') + 1; digit < name.size(); ++digit) {
    std::string other = name;
    other[digit] = other[digit] == '0' ? '1' : '0';
    named.set_topology_name(other);
    SmoothCall call(stub);
    call.send(named);
    EXPECT_EQ(call.finish().error_code(), StatusCode::NOT_FOUND);
    EXPECT_EQ(call.details().reason, "TOPOLOGY_NOT_FOUND");
  }
  SmoothCall broken(stub);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  broken.send(spec);
  v1::Chunk bad = chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh.elements);
  bad.set_crc32c(1);
  broken.send(bad);
  EXPECT_EQ(broken.finish().error_code(), StatusCode::DATA_LOSS);
  conservation.check(static_cast<std::int64_t>(mesh.elements.size() + mesh.fixed.size()));

  named.set_topology_name(name);
  SmoothCall right(stub);
  right.send(named);
  right.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh.coordinates)));
  right.half_close();
  EXPECT_TRUE(right.finish().ok());
  EXPECT_EQ(right.result(), mesh.moved());
}

// --- the store of results ---------------------------------------------------------------

// It never refuses a job that fits: the oldest results go before their time, and say so.
TEST(ResultStoreIsFull, AndGivesUpTheOldestForEveryNewOne) {
  constexpr int kRoom = 3;
  server::ServerConfig config = quiet_config();
  config.max_kept_result_bytes = kRoom * 120;
  InProcessServer server(config);
  server.keeps_something();
  Stub stub(server.channel());
  Conservation conservation(stub);
  v1::JobSpec spec = TwoTetrahedra::spec();
  *spec.mutable_result_ttl() = google::protobuf::util::TimeUtil::SecondsToDuration(600);
  std::vector<std::string> names;
  for (int job = 0; job < 3 * kRoom; ++job) {
    SmoothCall call(stub);
    call.send_all({}, spec);
    names.push_back(call.read_accepted());
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    wait_for_state(stub, names.back(), v1::STATE_SUCCEEDED);
    for (int old = 0; old <= job - kRoom; ++old) {
      const v1::Job expired = get_job(stub, names[static_cast<std::size_t>(old)]);
      EXPECT_EQ(expired.state(), v1::STATE_EXPIRED) << old << " of " << job;
    }
  }
  conservation.check(kRoom * 120);
  spec.mutable_inline_topology()->set_node_count(5 * kRoom + 1);
  SmoothCall large(stub);
  large.send(spec);
  EXPECT_EQ(large.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(large.details().reason, "MESH_TOO_LARGE");
  EXPECT_EQ(large.detail("field"), "result_ttl");
}

}  // namespace
}  // namespace meshsmooth::testing
