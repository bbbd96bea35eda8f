#include "port_probe.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <string>
#include <thread>

#include "wire/descriptor.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

/// Listens on a port of the loopback, and accepts only when told to.
class Listener {
 public:
  Listener() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(socket_.number(), any, size), 0);
    EXPECT_EQ(listen(socket_.number(), 8), 0);
    EXPECT_EQ(getsockname(socket_.number(), any, &size), 0);
    port_ = ntohs(address.sin_port);
  }
  [[nodiscard]] int port() const { return port_; }
  /// The first bytes of the next connection, which gets `answer`.
  [[nodiscard]] std::string serve_one(const std::string& answer) const {
    const wire::Descriptor connection(accept(socket_.number(), nullptr, nullptr));
    std::string bytes(4096, '\0');
    const ssize_t size = recv(connection.number(), bytes.data(), bytes.size(), 0);
    EXPECT_GT(size, 0);
    bytes.resize(static_cast<std::size_t>(size));
    EXPECT_EQ(send(connection.number(), answer.data(), answer.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(answer.size()));
    return bytes;
  }

 private:
  wire::Descriptor socket_{socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  int port_ = 0;
};

TEST(PortProbe, IsNotSatisfiedByAConnectionThatNobodyAccepts) {
  const Listener listener;
  EXPECT_FALSE(port_answers("127.0.0.1:0", listener.port(), false, 50ms));
}

TEST(PortProbe, WantsAByteOfTheProtocol) {
  const Listener listener;
  for (const bool tls : {false, true}) {
    std::string hello;
    std::thread server([&] { hello = listener.serve_one("x"); });
    EXPECT_TRUE(port_answers("127.0.0.1:0", listener.port(), tls, 60s)) << tls;
    server.join();
    EXPECT_TRUE(hello.starts_with(tls ? "\x16\x03" : "PRI * HTTP/2.0")) << tls;
  }
}

TEST(PortProbe, FailsWhereNobodyListens) {
  int port = 0;
  {
    const Listener listener;
    port = listener.port();
  }
  EXPECT_FALSE(port_answers("127.0.0.1:0", port, false, 60s));
  EXPECT_FALSE(port_answers("unix:/nowhere/socket", 0, false, 60s));
}

TEST(PortProbe, CallsAPortDeadAfterTwoFailuresInARow) {
  bool answers = false;
  PortWatch watch([&] { return answers; });
  EXPECT_FALSE(watch.is_dead());
  answers = true;
  EXPECT_FALSE(watch.is_dead());
  answers = false;
  EXPECT_FALSE(watch.is_dead());
  EXPECT_TRUE(watch.is_dead());
  EXPECT_TRUE(watch.is_dead());
  answers = true;
  EXPECT_FALSE(watch.is_dead());
}

}  // namespace
}  // namespace meshsmooth::server
