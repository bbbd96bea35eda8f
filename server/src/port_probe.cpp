#include "port_probe.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <string_view>

#include "wire/descriptor.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::server {
namespace {

using Clock = std::chrono::steady_clock;

// HTTP/2's preface with empty settings.
std::string plain_hello() {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + std::string("\0\0\0\4\0\0\0\0\0", 9);
}

// The begin of a handshake that goes no further: the server needs no certificate of ours for it.
std::string tls_hello() {
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_client_method()),
                                                             SSL_CTX_free);
  const std::unique_ptr<SSL, void (*)(SSL*)> ssl(SSL_new(context.get()), SSL_free);
  BIO* const out = BIO_new(BIO_s_mem());
  SSL_set_bio(ssl.get(), BIO_new(BIO_s_mem()), out);  // owned by it
  SSL_set_connect_state(ssl.get());
  SSL_do_handshake(ssl.get());
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(out, &bytes);
  return {bytes, static_cast<std::size_t>(size)};
}

bool wait_for(int socket, short event, Clock::time_point until) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    pollfd wanted{socket, event, 0};
    const int ready = poll(&wanted, 1, left > 0 ? static_cast<int>(left) : 0);
    if (ready >= 0 || errno != EINTR) return ready > 0;
  }
}

wire::Descriptor open_socket(int family) {
  return wire::Descriptor(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

bool connects(int socket, const sockaddr* address, socklen_t size, Clock::time_point until) {
  if (::connect(socket, address, size) == 0) return true;
  if (errno != EINPROGRESS || !wait_for(socket, POLLOUT, until)) return false;
  int error = 0;
  socklen_t error_size = sizeof error;
  return getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &error_size) == 0 && error == 0;
}

wire::Descriptor connect_to(const std::string& listen, int port, Clock::time_point until) {
  constexpr std::string_view kUnix = "unix:";
  if (listen.starts_with(kUnix)) {
    const auto address = wire::socket_address(listen.substr(kUnix.size()));
    wire::Descriptor socket = open_socket(AF_UNIX);
    if (address && socket &&
        connects(socket.number(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address,
                 until)) {
      return socket;
    }
    return wire::Descriptor();
  }
  std::string host = listen.substr(0, listen.rfind(':'));
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  // An address that stands for all, 0.0.0.0 or ::, leads to this host.
  if (getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0)
    return wire::Descriptor();
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    wire::Descriptor socket = open_socket(a->ai_family);
    if (socket && connects(socket.number(), a->ai_addr, a->ai_addrlen, until)) return socket;
  }
  return wire::Descriptor();
}

}  // namespace

bool port_answers(const std::string& listen, int port, bool tls,
                  std::chrono::milliseconds timeout) {
  const auto until = Clock::now() + timeout;
  const wire::Descriptor socket = connect_to(listen, port, until);
  if (!socket) return false;
  const std::string hello = tls ? tls_hello() : plain_hello();
  if (send(socket.number(), hello.data(), hello.size(), MSG_NOSIGNAL) < 0) return false;
  if (!wait_for(socket.number(), POLLIN, until)) return false;
  char first = 0;
  return recv(socket.number(), &first, 1, MSG_DONTWAIT) == 1;
}

}  // namespace meshsmooth::server
