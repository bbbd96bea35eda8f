#include "listener.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "meshsmooth/error.hpp"
#include "socket_folder.hpp"
#include "socket_path.hpp"
#include "support/scratch_folder.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::server {
namespace {

using wire::Descriptor;

bool eventually(const std::function<bool()>& is_true) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

Descriptor connect_to(int port) {
  Descriptor peer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(peer.number(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  return peer;
}

void speak(const Descriptor& peer) { EXPECT_EQ(send(peer.number(), "x", 1, MSG_NOSIGNAL), 1); }

/// Whether the listener has closed it.
bool is_closed(const Descriptor& peer) {
  char byte = 0;
  return recv(peer.number(), &byte, 1, MSG_DONTWAIT) == 0 ||
         (errno != EAGAIN && errno != EWOULDBLOCK);
}

/// Reads so many bytes, of which not all need have arrived yet.
bool read_whole(const Descriptor& peer, std::size_t count) {
  std::string read(count, ' ');
  return eventually([&] {
    const ssize_t more = recv(peer.number(), read.data(), count, MSG_DONTWAIT);
    if (more > 0) count -= static_cast<std::size_t>(more);
    return count == 0;
  });
}

class ListenerTest : public ::testing::Test {
 protected:
  void start(const Listener::Limits& limits) {
    listener_ = std::make_unique<Listener>("127.0.0.1:0", limits);
    listener_->start([this](int descriptor, int) {
      const std::lock_guard lock(mutex_);
      open_.emplace_back(descriptor);
    });
  }
  [[nodiscard]] std::size_t open_count() {
    const std::lock_guard lock(mutex_);
    return open_.size();
  }
  [[nodiscard]] int port() const { return listener_->port(); }
  /// What has come over all connections, so far.
  std::size_t read_all() {
    const std::lock_guard lock(mutex_);
    std::string buffer(1 << 20, ' ');
    for (const Descriptor& connection : open_) {
      const ssize_t count = recv(connection.number(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      read_ += count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    return read_;
  }

  std::size_t read_ = 0;
  std::mutex mutex_;
  std::vector<Descriptor> open_;  // what was passed on
  std::unique_ptr<Listener> listener_;
};

TEST_F(ListenerTest, PassesOnWhoBeginsToSpeak) {
  start({});
  const Descriptor silent = connect_to(port()), speaking = connect_to(port());
  speak(speaking);
  EXPECT_TRUE(eventually([&] { return open_count() == 1; }));
  EXPECT_FALSE(is_closed(silent));
}

TEST_F(ListenerTest, ClosesWhoIsSilentForTooLong) {
  start({.first_byte_timeout = std::chrono::milliseconds(1)});
  const Descriptor silent = connect_to(port());
  EXPECT_TRUE(eventually([&] { return is_closed(silent); }));
  EXPECT_TRUE(eventually([&] { return listener_->refused_count() == 1; }));
}

TEST_F(ListenerTest, StaysBelowTheDescriptorLimitAndServesOthers) {
  const int next = Descriptor(dup(0)).number();  // the lowest free one
  // Its own, the peers' and 20 for connections; those of the peers are opened alternately.
  start({.max_descriptor = next + 140});
  std::vector<Descriptor> silent;
  for (int i = 0; i < 400; ++i) {
    silent.push_back(connect_to(port()));
    if (silent.size() > 100) silent.erase(silent.begin());
    const Descriptor highest(dup(0));
    ASSERT_LT(highest.number(), next + 250);
  }
  const Descriptor victim = connect_to(port());
  speak(victim);
  EXPECT_TRUE(eventually([&] { return open_count() == 1; }));
  for (const Descriptor& connection : open_) EXPECT_LT(connection.number(), next + 140);
}

TEST_F(ListenerTest, BoundsConnectionsAndCountsThoseThatHaveEnded) {
  start({.max_connections = 3});
  std::vector<Descriptor> peers;
  for (int i = 0; i < 3; ++i) {
    peers.push_back(connect_to(port()));
    speak(peers.back());
  }
  ASSERT_TRUE(eventually([&] { return open_count() == 3; }));
  const Descriptor refused = connect_to(port());
  speak(refused);
  EXPECT_TRUE(eventually([&] { return is_closed(refused); }));
  {
    const std::lock_guard lock(mutex_);
    open_.clear();
  }
  // Open connections are counted again after a while only.
  EXPECT_TRUE(eventually([&] {
    const Descriptor next = connect_to(port());
    speak(next);
    eventually([&] { return open_count() == 1 || is_closed(next); });
    return open_count() == 1;
  }));
}

TEST_F(ListenerTest, CutsAConnection) {
  start({});
  const Descriptor peer = connect_to(port()), other = connect_to(port());
  speak(peer);
  speak(other);
  ASSERT_TRUE(eventually([&] { return open_count() == 2; }));
  sockaddr_in own{};
  socklen_t size = sizeof own;
  ASSERT_EQ(getsockname(peer.number(), reinterpret_cast<sockaddr*>(&own), &size), 0);
  listener_->cut("ipv4:127.0.0.1:" + std::to_string(ntohs(own.sin_port)));
  EXPECT_TRUE(eventually([&] { return is_closed(peer); }));
  EXPECT_FALSE(is_closed(other));
}

void send_bytes(const Descriptor& from, std::size_t count) {
  const std::string bytes(count, 'x');
  EXPECT_EQ(send(from.number(), bytes.data(), count, MSG_NOSIGNAL), static_cast<ssize_t>(count));
}

TEST_F(ListenerTest, CutsOffWhoSendsMuchWithoutAnswer) {
  start({.max_unanswered_bytes = 50'000});
  const Descriptor flooding = connect_to(port()), other = connect_to(port());
  speak(other);
  send_bytes(flooding, 100'000);
  EXPECT_TRUE(eventually([&] { return read_all() >= 100'000 && is_closed(flooding); }));
  EXPECT_FALSE(is_closed(other));
  EXPECT_TRUE(eventually([&] { return listener_->refused_count() == 1; }));
}

TEST_F(ListenerTest, CutsOffWhoSendsMostWhenAllTogetherSendMuch) {
  std::atomic<std::uint64_t> budget = 100'000;
  start({.max_unanswered_bytes = 50'000, .unanswered_budget_bytes = [&] { return budget.load(); }});
  std::vector<Descriptor> peers;
  for (const std::size_t bytes : {10'000, 40'000, 20'000, 30'000}) {
    peers.push_back(connect_to(port()));
    send_bytes(peers.back(), bytes);
  }
  ASSERT_TRUE(eventually([&] { return read_all() >= 100'000; }));
  EXPECT_FALSE(is_closed(peers[1]));
  budget = 50'000;
  EXPECT_TRUE(eventually([&] { return is_closed(peers[1]) && is_closed(peers[3]); }));
  EXPECT_FALSE(is_closed(peers[0]));
  EXPECT_FALSE(is_closed(peers[2]));
  EXPECT_TRUE(eventually([&] { return listener_->refused_count() == 2; }));
}

TEST_F(ListenerTest, LeavesWhoIsNotRead) {
  start({.max_unanswered_bytes = 50'000});
  const Descriptor waiting = connect_to(port());
  send_bytes(waiting, 100'000);
  ASSERT_TRUE(eventually([&] { return open_count() == 1; }));
  const Descriptor flooding = connect_to(port());
  send_bytes(flooding, 100'000);
  ASSERT_TRUE(eventually([&] { return open_count() == 2; }));
  EXPECT_TRUE(read_whole(open_.back(), 100'000));
  EXPECT_TRUE(eventually([&] { return is_closed(flooding); }));
  EXPECT_FALSE(is_closed(waiting));
}

TEST_F(ListenerTest, LeavesWhoIsAnswered) {
  start({.max_unanswered_bytes = 50'000});
  const Descriptor uploading = connect_to(port());
  speak(uploading);
  ASSERT_TRUE(eventually([&] { return open_count() == 1; }));
  for (int i = 0; i < 20; ++i) {
    send_bytes(uploading, 10'000);
    EXPECT_TRUE(read_whole(open_.front(), 10'000));
    speak(open_.front());  // as gRPC opens a window
  }
  const Descriptor flooding = connect_to(port());
  send_bytes(flooding, 100'000);
  EXPECT_TRUE(eventually([&] {
    read_all();
    return is_closed(flooding);
  }));  // all have been looked at
  EXPECT_FALSE(is_closed(uploading));
}

TEST_F(ListenerTest, NamesAPortInUse) {
  start({});
  try {
    const Listener second("127.0.0.1:" + std::to_string(port()), {});
    FAIL() << "nothing thrown";
  } catch (const InvalidOption& error) {
    EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos) << error.what();
  }
}

TEST(SocketPath, ReplacesADeadSocketOnly) {
  const testing::ScratchFolder folder;
  const std::string path = folder.path("socket").string();
  auto first = std::make_unique<Listener>("unix:" + path, Listener::Limits{});
  struct stat facts {};
  ASSERT_EQ(stat(path.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600U);
  EXPECT_THROW(Listener("unix:" + path, {}), InvalidOption);
  EXPECT_FALSE(is_dead_socket(path)) << "the first still has it";
  first.reset();
  EXPECT_NE(stat(path.c_str(), &facts), 0);

  {  // as a server that was killed
    const Descriptor dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    const auto address = wire::socket_address(path);
    ASSERT_EQ(bind(dead.number(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address),
              0);
  }
  EXPECT_TRUE(is_dead_socket(path));
  const Listener next("unix:" + path, {});
  EXPECT_FALSE(is_dead_socket(path));
}

TEST(SocketFolder, SweepsThoseOfServersThatWereKilled) {
  const testing::ScratchFolder parent;
  ASSERT_EQ(setenv("TMPDIR", parent.path().c_str(), 1), 0);
  const std::string dead = parent.path("meshsmooth-dead00").string();
  const std::string other = parent.path("meshsmooth-other0").string();
  ASSERT_EQ(mkdir(dead.c_str(), 0700), 0);
  ASSERT_EQ(mkdir(other.c_str(), 0700), 0);  // its server is just making the socket
  for (const char* name : {"/socket", "/leases"}) {
    const Descriptor socket(::socket(AF_UNIX, SOCK_STREAM, 0));
    const auto address = wire::socket_address(dead + name);
    ASSERT_EQ(bind(socket.number(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address),
              0);
  }
  SocketFolder living("listen");
  const Listener listener(living.address(), {});
  const SocketFolder next("listen");
  unsetenv("TMPDIR");
  struct stat facts {};
  EXPECT_NE(stat(dead.c_str(), &facts), 0);
  EXPECT_EQ(stat(other.c_str(), &facts), 0);
  EXPECT_EQ(stat(living.address().substr(5).c_str(), &facts), 0);
}

}  // namespace
}  // namespace meshsmooth::server
