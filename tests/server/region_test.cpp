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
#include "server/region_caller.hpp"
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

class RegionTest : public ::testing::Test {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = sharing_config(quiet_config());
    config.max_job_bytes = config.host_memory_limit_bytes;
    return config;
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
};

TEST_F(RegionTest, IsAFeatureWithALimit) {
  const v1::GetServerInfoResponse info = server_info(stub_);
  EXPECT_THAT(info.features(), ::testing::Contains("shared_memory"));
  EXPECT_EQ(info.limits().max_region_bytes(), (1 << 30) / 4);
}

TEST_F(RegionTest, ReservesItsBytesUntilItIsReturned) {
  {
    const RegionCaller region = RegionCaller::ready(stub_, kMiB + 1);
    EXPECT_EQ(region.lease().size_bytes() % sysconf(_SC_PAGESIZE), 0);
    EXPECT_GT(region.lease().size_bytes(), kMiB);
    EXPECT_EQ(reserved_bytes(stub_), region.lease().size_bytes());
  }
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(RegionTest, CanBeWrittenByItsCallerAfterItIsSealed) {
  const RegionCaller region = RegionCaller::ready(stub_, kMiB);
  std::memset(region.bytes().data(), 7, region.bytes().size());
  EXPECT_EQ(region.read(kMiB - 1, 1), "\x07");
}

TEST_F(RegionTest, WithstandsWhatWouldTakeItsPagesAway) {
  RegionCaller region = RegionCaller::ready(stub_, kMiB);
  const int file = region.file().number();
  const auto expect_refused = [](int result, const char* what) {
    EXPECT_EQ(result, -1) << what;
    EXPECT_EQ(errno, EPERM) << what;
  };
  expect_refused(ftruncate(file, 0), "shrink");
  expect_refused(ftruncate(file, 2 * kMiB), "grow");
  expect_refused(fallocate(file, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096), "hole");
  expect_refused(madvise(region.bytes().data(), 4096, MADV_REMOVE), "remove");
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

TEST_F(RegionTest, IsReturnedWhenItsCallerIsKilled) {
  // A region is its caller's connection, which this process gives to another one by fork.
  RegionCaller region = RegionCaller::ready(stub_, kMiB);
  Child child([] { return 'x'; });
  region.end();
  EXPECT_EQ(reserved_bytes(stub_), region.lease().size_bytes());  // the child has all of it
  child.kill();
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(RegionTest, StaysReservedAsLongAsSomebodyMapsIt) {
  RegionCaller region = RegionCaller::ready(stub_, kMiB);
  region.close_file();
  region.close_socket();
  // Its lease has ended: no job can name it.
  EXPECT_TRUE(eventually([&] {
    SmoothCall call(stub_);
    call.send(TwoTetrahedraInRegion::spec(region.lease().region_name()));
    return call.finish().error_code() == StatusCode::NOT_FOUND;
  }));
  EXPECT_EQ(reserved_bytes(stub_), region.lease().size_bytes());
  region.unmap();
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(RegionTest, TakesATicketOnce) {
  RegionCaller region(stub_, kMiB);
  EXPECT_TRUE(region.fetch());
  const wire::Descriptor socket = connect_to(region.lease().socket_path());
  send(socket.number(), region.lease().ticket().data(), region.lease().ticket().size(), 0);
  EXPECT_EQ(next_message(socket).kind, Kind::end);
}

TEST_F(RegionTest, RefusesOtherTickets) {
  const RegionCaller region(stub_, kMiB);
  for (const std::string& ticket :
       {std::string(32, '\0'), region.lease().ticket().substr(1), region.lease().ticket() + "x"}) {
    const wire::Descriptor socket = connect_to(region.lease().socket_path());
    send(socket.number(), ticket.data(), ticket.size(), 0);
    EXPECT_EQ(next_message(socket).kind, Kind::end);
  }
}

TEST_F(RegionTest, EndsALeaseThatNobodyFetches) {
  const RegionCaller region(stub_, kMiB);
  EXPECT_EQ(reserved_bytes(stub_), kMiB);
  EXPECT_TRUE(comes_to_be_reserved(stub_, 0));
}

TEST_F(RegionTest, ServesItsOwnUserAlone) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to be somebody else";
  RegionCaller region(stub_, kMiB);
  const std::string path = region.lease().socket_path();
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
    return region.fetch() ? 'y' : 'n';
  };
  EXPECT_EQ(Child(receives).code(), 'n');
  EXPECT_TRUE(region.fetch());
}

TEST_F(RegionTest, RefusesSizesThatCannotBe) {
  v1::LeaseRegionResponse response;
  EXPECT_EQ(reason_of(lease_region(stub_, 0, response)), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason_of(lease_region(stub_, -1, response)), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(reason_of(lease_region(stub_, INT64_MAX, response)), "MESH_TOO_LARGE");
  EXPECT_EQ(reason_of(lease_region(stub_, (1 << 28) + 1, response)), "MESH_TOO_LARGE");
}

TEST_F(RegionTest, LeasesNoMoreThanItsLimitTogether) {
  const RegionCaller first = RegionCaller::ready(stub_, 200 * kMiB);
  v1::LeaseRegionResponse response;
  EXPECT_EQ(reason_of(lease_region(stub_, 100 * kMiB, response)), "HOST_MEMORY_BUSY");
}

TEST_F(RegionTest, LeavesNoDescriptorBehind) {
  expect_healthy_service(stub_);
  Conservation conservation(stub_);
  for (int i = 0; i < 50; ++i) {
    RegionCaller region(stub_, kMiB);
    if (i % 5 == 0) continue;  // its ticket expires
    EXPECT_TRUE(region.fetch());
    if (i % 5 == 1) continue;
    region.map();
    if (i % 5 == 2) continue;
    region.say_mapped();
    if (i % 5 == 3) region.close_socket();
  }
  conservation.check();
}

TEST_F(RegionTest, IsWantedBackWhenMemoryIsShort) {
  const RegionCaller region = RegionCaller::ready(stub_, kMiB);
  server_.fake().set_estimate({.host_bytes = (1 << 30) - 64 * kMiB, .device_bytes = 0});
  SmoothCall call(stub_);
  const RegionCaller large = RegionCaller::ready(stub_, 128 * kMiB);
  call.send(TwoTetrahedra::spec());
  EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "HOST_MEMORY_BUSY");
  EXPECT_EQ(next_message(region.socket()).message, wire::RegionMessage::wanted_back);
  EXPECT_EQ(next_message(large.socket()).message, wire::RegionMessage::wanted_back);
}

TEST(RegionSettings, WantsIdleRegionsBack) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.region_idle_timeout = std::chrono::milliseconds(1);
  InProcessServer server(config);
  Stub stub(server.channel());
  const RegionCaller region = RegionCaller::ready(stub, kMiB);
  EXPECT_EQ(next_message(region.socket()).message, wire::RegionMessage::wanted_back);
}

TEST(RegionSettings, WantsAllBackWhenItDrains) {
  InProcessServer server(sharing_config(quiet_config()));
  Stub stub(server.channel());
  const RegionCaller region = RegionCaller::ready(stub, kMiB);
  const RegionCaller not_fetched(stub, kMiB);
  const std::string path = region.lease().socket_path();
  server.drain();
  EXPECT_EQ(next_message(region.socket()).message, wire::RegionMessage::wanted_back);
  EXPECT_EQ(next_message(region.socket()).kind, Kind::end);
  EXPECT_NE(access(path.c_str(), F_OK), 0);
  EXPECT_NE(access(path.substr(0, path.rfind('/')).c_str(), F_OK), 0);
}

TEST(RegionSettings, CountsRegionsOfACallerAgainstItsLimit) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.max_bytes_per_caller = 3 * kMiB;
  InProcessServer server(config);
  Stub stub(server.channel());
  const RegionCaller region = RegionCaller::ready(stub, 2 * kMiB);
  v1::LeaseRegionResponse response;
  EXPECT_EQ(reason_of(lease_region(stub, 2 * kMiB, response)), "QUOTA_EXCEEDED");
  EXPECT_EQ(reason_of(lease_region(stub, 4 * kMiB, response)), "MESH_TOO_LARGE");
}

TEST(RegionSettings, RefusesASocketThatCannotBe) {
  for (const std::string& path : {std::string("unix:/no/such/folder/socket"),
                                  std::string("unix:/") + std::string(200, 'x')}) {
    server::ServerConfig config = sharing_config(quiet_config());
    config.region_socket = path;
    server::Server server(
        config, [] { return std::make_unique<FakeSmoother>(std::make_shared<FakeControl>()); });
    EXPECT_THROW(server.start(), InvalidOption);
  }
}

TEST(RegionSettings, ServesOnAPathOfItsOwn) {
  const ScratchFolder folder;
  const std::string path = folder.path("regions").string();
  {
    // A server that was killed has left its socket.
    const wire::Descriptor left(::socket(AF_UNIX, SOCK_SEQPACKET, 0));
    const auto address = wire::socket_address(path).value();
    ASSERT_EQ(bind(left.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  server::ServerConfig config = sharing_config(quiet_config());
  config.region_socket = "unix:" + path;
  InProcessServer server(config);
  Stub stub(server.channel());
  const RegionCaller region = RegionCaller::ready(stub, kMiB);
  EXPECT_EQ(region.lease().socket_path(), path);
}

TEST(RegionSettings, SharesNothingWithoutASocket) {
  server::ServerConfig config = sharing_config(quiet_config());
  config.region_socket = "";
  InProcessServer server(config);
  Stub stub(server.channel());
  v1::LeaseRegionResponse response;
  EXPECT_EQ(reason_of(lease_region(stub, kMiB, response)), "OPTION_NOT_SUPPORTED");
  EXPECT_THAT(server_info(stub).features(), ::testing::Not(::testing::Contains("shared_memory")));
  EXPECT_EQ(server_info(stub).limits().max_region_bytes(), 0);
}

}  // namespace
}  // namespace meshsmooth::testing
