#include "listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>

#include "config.hpp"
#include "socket_path.hpp"

namespace meshsmooth::server {
namespace {

using wire::Descriptor;

constexpr std::string_view kUnix = "unix:";
constexpr auto kTick = std::chrono::milliseconds(100);
// Of the kernel's tables, which others fill too.
constexpr auto kPause = std::chrono::milliseconds(50);
constexpr int kAcceptedAtOnce = 64;
// Who means to speak does so at once; all of them are polled.
constexpr std::size_t kMaxSilent = 1024;

[[noreturn]] void fail(const std::string& setting, const std::string& address,
                       const std::string& why) {
  throw_wrong_setting(setting, "cannot serve on " + address + ": " + why +
                                   "; is the address right and the port free?");
}

// Of the peer without its port; empty on this host.
std::string address_of(const sockaddr_storage& peer) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto& ip = reinterpret_cast<const sockaddr_in&>(peer).sin_addr;
    if (ntohl(ip.s_addr) >> 24 == 127) return {};
    return inet_ntop(AF_INET, &ip, text.data(), text.size());
  }
  if (peer.ss_family != AF_INET6) return {};
  const in6_addr& ip = reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr;
  if (IN6_IS_ADDR_LOOPBACK(&ip) || (IN6_IS_ADDR_V4MAPPED(&ip) && ip.s6_addr[12] == 127)) return {};
  // Who has one address of IPv6 mostly has the other 2^64 of its network.
  if (IN6_IS_ADDR_V4MAPPED(&ip)) return inet_ntop(AF_INET6, &ip, text.data(), text.size());
  in6_addr network = ip;
  std::fill(network.s6_addr + 8, network.s6_addr + 16, std::uint8_t{0});
  return inet_ntop(AF_INET6, &network, text.data(), text.size());
}

// 0 on a Unix socket.
int port_of(const sockaddr_storage& peer) {
  if (peer.ss_family == AF_INET6) {
    return ntohs(reinterpret_cast<const sockaddr_in6&>(peer).sin6_port);
  }
  return peer.ss_family == AF_INET ? ntohs(reinterpret_cast<const sockaddr_in&>(peer).sin_port) : 0;
}

void set_option(int socket, int level, int option, int value) {
  setsockopt(socket, level, option, &value, sizeof value);
}

}  // namespace

int max_connection_descriptor() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur > (1 << 20)) return 1 << 20;
  const int all = static_cast<int>(limit.rlim_cur);
  // The transport alone may take two for each of 128 leases and 256 connections.
  return all - std::min(all / 4, 1024);
}

int free_connection_descriptors() {
  const Descriptor lowest(eventfd(0, EFD_CLOEXEC));
  return lowest ? std::max(0, max_connection_descriptor() - lowest.number()) : 0;
}

Listener::Listener(const std::string& address, Limits limits, std::string setting)
    : limits_(limits),
      setting_(std::move(setting)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      open_({limits.max_connections, limits.max_connections_per_address,
             address.starts_with(kUnix) ? 0 : limits.max_unanswered_bytes,
             limits.unanswered_budget_bytes}) {
  if (!address.starts_with(kUnix)) {
    listen_on_host(address);
    return;
  }
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) fail(setting_, address, std::strerror(errno));
  listen_on_path(socket.number(), address.substr(kUnix.size()), setting_);
  path_ = address.substr(kUnix.size());
  listeners_.push_back(std::move(socket));
}

void Listener::listen_on_host(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const std::string port = address.substr(colon + 1);
  addrinfo hints{};
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    fail(setting_, address, gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  // Every address of this host includes those of both families, as with gRPC's own listener.
  if (host == "0.0.0.0" || host == "::") {
    sockaddr_in6 any{};
    any.sin6_family = AF_INET6;
    any.sin6_addr = in6addr_any;
    any.sin6_port = htons(static_cast<std::uint16_t>(std::stoi(port)));
    bind_to(AF_INET6, reinterpret_cast<const sockaddr*>(&any), sizeof any, false);
    if (!listeners_.empty() || errno == EADDRINUSE) found = nullptr;
  }
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    bind_to(a->ai_family, a->ai_addr, a->ai_addrlen, true);
  }
  if (listeners_.empty()) fail(setting_, address, std::strerror(errno));
}

void Listener::bind_to(int family, const sockaddr* address, socklen_t size, bool only_this_family) {
  Descriptor socket(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) return;
  // A restart need not wait for connections of the server before.
  set_option(socket.number(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (family == AF_INET6) {
    set_option(socket.number(), IPPROTO_IPV6, IPV6_V6ONLY, only_this_family ? 1 : 0);
  }
  sockaddr_storage bound{};
  std::memcpy(&bound, address, size);
  in_port_t& port = family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(bound).sin6_port
                                       : reinterpret_cast<sockaddr_in&>(bound).sin_port;
  if (port == 0) port = htons(static_cast<std::uint16_t>(port_));  // one for all addresses
  if (bind(socket.number(), reinterpret_cast<const sockaddr*>(&bound), size) != 0 ||
      listen(socket.number(), SOMAXCONN) != 0 ||
      getsockname(socket.number(), reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
    return;
  }
  port_ = ntohs(port);
  listeners_.push_back(std::move(socket));
}

void Listener::start(Accepted accepted) {
  accepted_ = std::move(accepted);
  thread_ = std::thread([this] { run(); });
}

void Listener::wake() const {
  const std::uint64_t one = 1;
  static_cast<void>(!write(wake_.number(), &one, sizeof one));
}

void Listener::cut(const std::string& peer) {
  {
    const std::lock_guard lock(mutex_);
    to_cut_.push_back(peer);
  }
  wake();
}

// By this thread, since no connection can be accepted meanwhile with the number of a closed one.
void Listener::cut_wanted() {
  std::uint64_t ignored = 0;
  static_cast<void>(!read(wake_.number(), &ignored, sizeof ignored));
  std::vector<std::string> peers;
  {
    const std::lock_guard lock(mutex_);
    peers.swap(to_cut_);
  }
  for (const std::string& peer : peers) refused_ += open_.cut(peer);
}

void Listener::close() {
  if (stopped_.exchange(true)) return;
  wake();
  if (thread_.joinable()) thread_.join();
  silent_.clear();
  if (!path_.empty()) {
    listeners_.clear();
    if (is_dead_socket(path_)) unlink(path_.c_str());  // not that of a server that came after
  }
  listeners_.clear();
}

void Listener::run() {
  std::vector<pollfd> events;
  while (!stopped_) {
    const auto now = Clock::now();
    while (!silent_.empty() && now - silent_.front().accepted >= limits_.first_byte_timeout) {
      silent_.pop_front();
      ++refused_;
    }
    const bool paused = now < pause_until_;
    events = {{wake_.number(), POLLIN, 0}};
    for (const Descriptor& listener : listeners_) {
      events.push_back({paused ? -1 : listener.number(), POLLIN, 0});
    }
    for (const Silent& peer : silent_) events.push_back({peer.socket.number(), POLLIN, 0});
    std::chrono::milliseconds patience(-1);
    if (paused || !silent_.empty()) patience = kTick;
    if (open_.watching()) patience = OpenConnections::kWatchInterval;
    if (poll(events.data(), events.size(), static_cast<int>(patience.count())) < 0) continue;
    if (open_.watching() && Clock::now() >= next_watch_) {
      refused_ += open_.cut_floods();
      next_watch_ = Clock::now() + OpenConnections::kWatchInterval;
    }
    if (events[0].revents != 0) cut_wanted();
    std::size_t place = 1 + listeners_.size();
    for (auto peer = silent_.begin(); peer != silent_.end(); ++place) {
      const auto next = std::next(peer);
      if (events[place].revents != 0) {
        pass_on(*peer);
        silent_.erase(peer);
      }
      peer = next;
    }
    for (std::size_t i = 0; i < listeners_.size(); ++i) {
      if (events[1 + i].revents != 0) accept_from(listeners_[i].number());
    }
  }
}

void Listener::accept_from(int listener) {
  for (int i = 0; i < kAcceptedAtOnce; ++i) {
    sockaddr_storage peer{};
    socklen_t size = sizeof peer;
    Descriptor socket(
        accept4(listener, reinterpret_cast<sockaddr*>(&peer), &size, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        if (!silent_.empty()) silent_.pop_front();
        pause_until_ = Clock::now() + kPause;
      }
      return;
    }
    const bool crowded = socket.number() >= limits_.max_descriptor || silent_.size() >= kMaxSilent;
    if (crowded) {
      ++refused_;
      do {
        if (silent_.empty()) break;
        silent_.pop_front();
        // To the number that is free now: with a higher one, the next would not be noticed.
        socket = Descriptor(fcntl(socket.number(), F_DUPFD_CLOEXEC, 0));
      } while (socket && socket.number() >= limits_.max_descriptor);
      if (!socket || socket.number() >= limits_.max_descriptor || silent_.size() >= kMaxSilent) {
        continue;
      }
    }
    if (!path_.empty()) {
      peer.ss_family = AF_UNIX;
    } else {
      set_option(socket.number(), IPPROTO_TCP, TCP_NODELAY, 1);
      if (limits_.unacknowledged_timeout.count() > 0) {
        set_option(socket.number(), IPPROTO_TCP, TCP_USER_TIMEOUT,
                   static_cast<int>(limits_.unacknowledged_timeout.count()));
      }
    }
    silent_.push_back({std::move(socket), address_of(peer), port_of(peer), Clock::now()});
  }
}

void Listener::pass_on(Silent& peer) {
  char first = 0;
  const ssize_t count = recv(peer.socket.number(), &first, 1, MSG_PEEK | MSG_DONTWAIT);
  if (count <= 0) return;  // it is gone
  if (!open_.has_room(peer.address)) {
    ++refused_;
    return;
  }
  const int descriptor = std::exchange(peer.socket, Descriptor()).release();
  open_.add(descriptor, peer.address, peer.port);
  accepted_(descriptor, listeners_.front().number());
}

}  // namespace meshsmooth::server
