#include "raw_tcp.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

/// All of them, whatever the kernel does at a time.
void write_all(int socket, std::span<const std::byte> bytes) {
  constexpr std::size_t kPiece = 1 << 20;
  while (!bytes.empty()) {
    const ssize_t n = send(socket, bytes.data(), std::min(bytes.size(), kPiece), MSG_NOSIGNAL);
    if (n <= 0) fail("raw TCP: cannot send");
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}
bool read_all(int socket, std::span<std::byte> bytes) {
  constexpr std::size_t kPiece = 1 << 20;
  while (!bytes.empty()) {
    const ssize_t n = recv(socket, bytes.data(), std::min(bytes.size(), kPiece), 0);
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

/// How many bytes go up, and then down.
using Transfer = std::array<std::uint64_t, 2>;

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

}  // namespace

RawListener listen_raw() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  if (bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      listen(listener, 1) != 0 ||
      getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    fail("raw TCP: cannot listen");
  }
  return {listener, ntohs(address.sin_port)};
}

void serve_raw(int listener) {
  const int socket = accept(listener, nullptr, nullptr);
  const int on = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  std::vector<std::byte> memory;
  for (Transfer transfer; read_all(socket, std::as_writable_bytes(std::span(transfer)));) {
    memory.resize(std::max<std::size_t>({memory.size(), transfer[0], transfer[1]}));
    if (!read_all(socket, std::span(memory).first(transfer[0]))) break;
    write_all(socket, std::span(memory).first(1));  // it has come
    write_all(socket, std::span(memory).first(transfer[1]));
  }
  close(socket);
}

RawClient::RawClient(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const sockaddr_in address = loopback(port);
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail("raw TCP: cannot connect");
  }
}
RawClient::~RawClient() { close(socket_); }

RawClient::Seconds RawClient::move(std::size_t up, std::size_t down) {
  memory_.resize(std::max({memory_.size(), up, down}));
  const Transfer transfer{up, down};
  const auto begin = Clock::now();
  write_all(socket_, std::as_bytes(std::span(transfer)));
  write_all(socket_, std::span(memory_).first(up));
  if (!read_all(socket_, std::span(memory_).first(1))) fail("raw TCP: the peer is gone");
  const auto middle = Clock::now();
  if (!read_all(socket_, std::span(memory_).first(down))) fail("raw TCP: the peer is gone");
  return {std::chrono::duration<double>(middle - begin).count(),
          std::chrono::duration<double>(Clock::now() - middle).count()};
}

}  // namespace meshsmooth::bench
