// Memory shared with callers on the same host: leases, their socket, what sealed memory withstands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/falloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "meshsmooth/error.hpp"
#include "server/conservation.hpp"
#include "server/segment_caller.hpp"
#include "support/in_process_server.hpp"
#include "support/process.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using Kind = wire::ReceivedMessage::Kind;

constexpr std::int64_t kMiB = 1 << 20;

std::string reason_of(const grpc::Status& status) {
  return wire::decode_status_details(status.error_details()).value_or(wire::StatusDetails{}).reason;
}

std::int64_t reserved_bytes(Stub& stub) { return server_info(stub).backends(0).reserved_bytes(); }

/// Waits until the server has so many bytes reserved.
bool comes_to_be_reserved(Stub& stub, std::int64_t bytes) {
  return eventually([&] { return reserved_bytes(stub) == bytes; });
}

/// A process beside this one that does something and then waits to be killed.
class Child {
 public:
  template <class Body>
  explicit Child(const Body& body) {
    std::array<int, 2> done{};
    EXPECT_EQ(pipe(done.data()), 0);
    id_ = fork();
    if (id_ == 0) {
      const char code = body();
      static_cast<void>(!write(done[1], &code, 1));
      for (;;) pause();
    }
    close(done[1]);
    EXPECT_EQ(read(done[0], &code_, 1), 1);
    close(done[0]);
  }
  ~Child() { kill(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// What the body returned.
  [[nodiscard]] char code() const { return code_; }
  void kill() {
    if (id_ <= 0) return;
    ::kill(id_, SIGKILL);
    waitpid(std::exchange(id_, 0), nullptr, 0);
  }

 private:
  pid_t id_ = 0;
  char code_ = 0;
};

class SharedMemoryTest : public ::testing::Test {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = sharing_config(quiet_config());
    config.max_job_bytes = config.host_memory_limit_bytes;
    return config;
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
};

TEST_F(SharedMemoryTest, IsAFeatureWithALimit) {
  const v1::GetServerInfoResponse info = server_info(stub_);
  EXPECT_THAT(info.features(), ::testing::Contains("shared_memory"));
  EXPECT_EQ(info.limits().max_shared_memory_bytes(), (1 << 30) / 4);
}

TEST_F(SharedMemoryTest, ReservesItsBytesUntilItIsReturned) {
  {
    const SegmentCaller segment = SegmentCaller::ready(stub_, kMiB + 1);
    EXPECT_EQ(segment.lease().size_bytes() % sysconf(_SC_PAGESIZE), 0);
    EXPECT_GT(segment.lease().size_bytes(), kMiB);
    EXPECT_EQ(reserved_bytes(stub_), segment.lease().size_bytes());
  }
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(SharedMemoryTest, CanBeWrittenByItsCallerAfterItIsSealed) {
  const SegmentCaller segment = SegmentCaller::ready(stub_, kMiB);
  std::memset(segment.bytes().data(), 7, segment.bytes().size());
  EXPECT_EQ(segment.read(kMiB - 1, 1), "\x07");
}

TEST_F(SharedMemoryTest, WithstandsWhatWouldTakeItsPagesAway) {
  SegmentCaller segment = SegmentCaller::ready(stub_, kMiB);
  const int file = segment.file().number();
  const auto expect_refused = [](int result, const char* what) {
    EXPECT_EQ(result, -1) << what;
    EXPECT_EQ(errno, EPERM) << what;
  };
  expect_refused(ftruncate(file, 0), "shrink");
  expect_refused(ftruncate(file, 2 * kMiB), "grow");
  expect_refused(fallocate(file, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096), "hole");
  expect_refused(madvise(segment.bytes().data(), 4096, MADV_REMOVE), "remove");
  expect_refused(fcntl(file, F_ADD_SEALS, F_SEAL_WRITE), "another seal");
  expect_refused(static_cast<int>(pwrite(file, "x", 1, 0)), "write");
  void* const again = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  EXPECT_EQ(again, MAP_FAILED) << "another map";
  // Nor by a description that is opened anew.
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const wire::Descriptor other(open(path.c_str(), O_RDWR | O_CLOEXEC));
  expect_refused(fallocate(other.number(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096),
                 "hole, anew");
}

TEST_F(SharedMemoryTest, IsReturnedWhenItsCallerIsKilled) {
  // A segment is its caller's connection, which this process gives to another one by fork.
  SegmentCaller segment = SegmentCaller::ready(stub_, kMiB);
  Child child([] { return 'x'; });
  segment.end();
  EXPECT_EQ(reserved_bytes(stub_), segment.lease().size_bytes());  // the child has all of it
  child.kill();
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(SharedMemoryTest, StaysReservedAsLongAsSomebodyMapsIt) {
  SegmentCaller segment = SegmentCaller::ready(stub_, kMiB);
  segment.close_file();
  segment.close_socket();
  // Its lease has ended: no job can name it.
  EXPECT_TRUE(eventually([&] {
    SmoothCall call(stub_);
    call.send(TwoTetrahedraInSegment::spec(segment.lease().segment_name()));
    return call.finish().error_code() == StatusCode::NOT_FOUND;
  }));
  EXPECT_EQ(reserved_bytes(stub_), segment.lease().size_bytes());
  segment.unmap();
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(SharedMemoryTest, TakesATicketOnce) {
  SegmentCaller segment(stub_, kMiB);
  EXPECT_TRUE(segment.fetch());
  const wire::Descriptor socket = connect_to(segment.lease().socket_path());
  send(socket.number(), segment.lease().ticket().data(), segment.lease().ticket().size(), 0);
  EXPECT_EQ(next_message(socket).kind, Kind::end);
}

TEST_F(SharedMemoryTest, RefusesOtherTickets) {
  const SegmentCaller segment(stub_, kMiB);
  for (const std::string& ticket : {std::string(32, '\0'), segment.lease().ticket().substr(1),
                                    segment.lease().ticket() + "x"}) {
    const wire::Descriptor socket = connect_to(segment.lease().socket_path());
    send(socket.number(), ticket.data(), ticket.size(), 0);
    EXPECT_EQ(next_message(socket).kind, Kind::end);
  }
}

TEST_F(SharedMemoryTest, EndsALeaseThatNobodyFetches) {
  const SegmentCaller segment(stub_, kMiB);
  EXPECT_EQ(reserved_bytes(stub_), kMiB);
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(SharedMemoryTest, ServesItsOwnUserAlone) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to be somebody else";
  SegmentCaller segment(stub_, kMiB);
  const std::string path = segment.lease().socket_path();
  const std::string folder = path.substr(0, path.rfind('/'));
  constexpr uid_t kNobody = 65534;
  const auto connects = [&] {
    if (seteuid(kNobody) != 0) return '?';
    return connect_to(path) ? 'y' : 'n';
  };
  EXPECT_EQ(Child(connects).code(), 'n');
  // Not by its mode alone.
  ASSERT_EQ(chmod(folder.c_str(), 0755), 0);
  ASSERT_EQ(chmod(path.c_str(), 0666), 0);
  const auto receives = [&] {
    if (setuid(kNobody) != 0) return '?';
    return segment.fetch() ? 'y' : 'n';
  };
  EXPECT_EQ(Child(receives).code(), 'n');
  EXPECT_TRUE(segment.fetch());
}

TEST_F(SharedMemoryTest, RefusesSizesThatCannotBe) {
  v1::LeaseSharedMemoryResponse response;
  EXPECT_EQ(reason_of(lease_shared_memory(stub_, 0, response)), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason_of(lease_shared_memory(stub_, -1, response)), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason_of(lease_shared_memory(stub_, INT64_MAX, response)), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(lease_shared_memory(stub_, (1 << 28) + 1, response)), "MESH_TOO_LARGE");
}

TEST_F(SharedMemoryTest, LeasesNoMoreThanItsLimitTogether) {
  const SegmentCaller first = SegmentCaller::ready(stub_, 200 * kMiB);
  v1::LeaseSharedMemoryResponse response;
  EXPECT_EQ(reason_of(lease_shared_memory(stub_, 100 * kMiB, response)), "HOST_MEMORY_BUSY");
}

TEST_F(SharedMemoryTest, LeavesNoDescriptorBehind) {
  expect_healthy_service(stub_);
  Conservation conservation(stub_);
  for (int i = 0; i < 50; ++i) {
    SegmentCaller segment(stub_, kMiB);
    if (i % 5 == 0) continue;  // its ticket expires
    EXPECT_TRUE(segment.fetch());
    if (i % 5 == 1) continue;
    segment.map();
    if (i % 5 == 2) continue;
    segment.say_mapped();
    if (i % 5 == 3) segment.close_socket();
  }
  conservation.check();
}

TEST_F(SharedMemoryTest, IsRecalledWhenMemoryIsShort) {
  const SegmentCaller segment = SegmentCaller::ready(stub_, kMiB);
  server_.fake().set_estimate({.host_bytes = (1 << 30) - 64 * kMiB, .device_bytes = 0});
  SmoothCall call(stub_);
  const SegmentCaller large = SegmentCaller::ready(stub_, 128 * kMiB);
  call.send(TwoTetrahedra::spec());
  EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "HOST_MEMORY_BUSY");
  EXPECT_EQ(next_message(segment.socket()).message, wire::LeaseMessage::recalled);
  EXPECT_EQ(next_message(large.socket()).message, wire::LeaseMessage::recalled);
}

TEST(SharedMemorySettings, RecallsIdleSegments) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.shared_memory_idle_timeout = std::chrono::milliseconds(1);
  InProcessServer server(config);
  Stub stub(server.channel());
  const SegmentCaller segment = SegmentCaller::ready(stub, kMiB);
  EXPECT_EQ(next_message(segment.socket()).message, wire::LeaseMessage::recalled);
}

TEST(SharedMemorySettings, RecallsAllWhenItDrains) {
  InProcessServer server(sharing_config(quiet_config()));
  Stub stub(server.channel());
  const SegmentCaller segment = SegmentCaller::ready(stub, kMiB);
  const SegmentCaller not_fetched(stub, kMiB);
  const std::string path = segment.lease().socket_path();
  server.drain();
  EXPECT_EQ(next_message(segment.socket()).message, wire::LeaseMessage::recalled);
  EXPECT_EQ(next_message(segment.socket()).kind, Kind::end);
  EXPECT_NE(access(path.c_str(), F_OK), 0);
  EXPECT_NE(access(path.substr(0, path.rfind('/')).c_str(), F_OK), 0);
}

TEST(SharedMemorySettings, CountsSegmentsOfACallerAgainstItsLimit) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.max_bytes_per_caller = 3 * kMiB;
  InProcessServer server(config);
  Stub stub(server.channel());
  const SegmentCaller segment = SegmentCaller::ready(stub, 2 * kMiB);
  v1::LeaseSharedMemoryResponse response;
  EXPECT_EQ(reason_of(lease_shared_memory(stub, 2 * kMiB, response)), "QUOTA_EXCEEDED");
  EXPECT_EQ(reason_of(lease_shared_memory(stub, 4 * kMiB, response)), "MESH_TOO_LARGE");
}

TEST(SharedMemorySettings, RefusesASocketThatCannotBe) {
  for (const std::string& path : {std::string("unix:/no/such/folder/socket"),
                                  std::string("unix:/") + std::string(200, 'x')}) {
    server::ServerConfig config = sharing_config(quiet_config());
    config.shared_memory_socket = path;
    server::Server server(
        config, [] { return std::make_unique<FakeSmoother>(std::make_shared<FakeControl>()); });
    EXPECT_THROW(server.start(), InvalidOption);
  }
}

TEST(SharedMemorySettings, ServesOnAPathOfItsOwn) {
  const ScratchFolder folder;
  const std::string path = folder.path("segments").string();
  {
    // A server that was killed has left its socket.
    const wire::Descriptor left(::socket(AF_UNIX, SOCK_SEQPACKET, 0));
    const auto address = wire::socket_address(path).value();
    ASSERT_EQ(bind(left.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  server::ServerConfig config = sharing_config(quiet_config());
  config.shared_memory_socket = "unix:" + path;
  InProcessServer server(config);
  Stub stub(server.channel());
  const SegmentCaller segment = SegmentCaller::ready(stub, kMiB);
  EXPECT_EQ(segment.lease().socket_path(), path);
}

TEST(SharedMemorySettings, SharesNothingWithoutASocket) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.shared_memory_socket = "";
  InProcessServer server(config);
  Stub stub(server.channel());
  v1::LeaseSharedMemoryResponse response;
  EXPECT_EQ(reason_of(lease_shared_memory(stub, kMiB, response)), "OPTION_NOT_SUPPORTED");
  EXPECT_THAT(server_info(stub).features(), ::testing::Not(::testing::Contains("shared_memory")));
  EXPECT_EQ(server_info(stub).limits().max_shared_memory_bytes(), 0);
}

}  // namespace
}  // namespace meshsmooth::testing
