#include "transport/lease_socket.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "config.hpp"
#include "meshsmooth/error.hpp"
#include "socket_path.hpp"

namespace meshsmooth::server {
namespace {

constexpr auto kTicketTime = std::chrono::seconds(5);
constexpr auto kMappingTime = std::chrono::seconds(60);  // of very large segments
constexpr auto kReturnTime = std::chrono::seconds(10);   // until a recalled segment is cut off
constexpr int kTickMilliseconds = 100;
constexpr std::size_t kMaxConnections = 256;

wire::Descriptor listener_at(const std::string& path) {
  wire::Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) throw_wrong_setting("shared-memory-socket", std::strerror(errno));
  listen_on_path(socket.number(), path, "shared-memory-socket");
  return socket;
}

bool is_own_user(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == geteuid();
}

// Piece by piece, so that copies of jobs come between.
void populate(CopyThreads& copies, const StagingMemory::PageLock& pages,
              const std::shared_ptr<wire::Descriptor>& socket,
              const std::shared_ptr<SharedSegment>& segment, std::size_t offset) {
  constexpr std::size_t kPiece = 32 << 20;
  const auto rest = segment->bytes().subspan(offset);
  if (rest.empty()) {
    segment->open_to_devices(pages);
    wire::send_message(socket->number(), wire::LeaseMessage::ready);
    segment->set_advertised();
    return;
  }
  const auto part = rest.first(std::min(rest.size(), kPiece));
  segment->populate(part);
  copies.post([&copies, &pages, socket, segment, next = offset + part.size()] {
    populate(copies, pages, socket, segment, next);
  });
}

}  // namespace

LeaseSocket::LeaseSocket(const std::string& path, SegmentLeases& leases, CopyThreads& copies,
                         const StagingMemory::PageLock& pages,
                         std::chrono::nanoseconds idle_timeout)
    : path_(path),
      leases_(leases),
      copies_(copies),
      pages_(pages),
      idle_timeout_(idle_timeout),
      listener_(listener_at(path)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      thread_([this] { run(); }) {}

void LeaseSocket::close() {
  if (stopped_.exchange(true)) return;
  wake();
  thread_.join();
  unlink(path_.c_str());
}

void LeaseSocket::wake() const {
  const std::uint64_t one = 1;
  static_cast<void>(!write(wake_.number(), &one, sizeof one));
}

void LeaseSocket::run() {
  std::vector<pollfd> events;
  while (!stopped_) {
    events = {{wake_.number(), POLLIN, 0}, {listener_.number(), POLLIN, 0}};
    for (const Connection& c : connections_) events.push_back({c.socket->number(), POLLIN, 0});
    const bool waits_for_time = !connections_.empty() || leases_.unsettled();
    poll(events.data(), events.size(), waits_for_time ? kTickMilliseconds : -1);

    std::uint64_t ignored = 0;
    static_cast<void>(!read(wake_.number(), &ignored, sizeof ignored));
    const auto now = Clock::now();
    std::size_t place = 2;
    for (auto connection = connections_.begin(); connection != connections_.end(); ++place) {
      const bool goes_on =
          (events[place].revents == 0 || receive(*connection)) && check(*connection, now);
      if (!goes_on && connection->segment) leases_.end(*connection->segment);
      if (!goes_on) shutdown(connection->socket->number(), SHUT_RDWR);
      connection = goes_on ? std::next(connection) : connections_.erase(connection);
    }
    if (events[1].revents != 0) accept_all();
    leases_.sweep(now);
  }
  for (const Connection& c : connections_) {
    if (c.segment) leases_.end(*c.segment);
  }
  connections_.clear();
}

void LeaseSocket::accept_all() {
  while (connections_.size() < kMaxConnections) {
    wire::Descriptor socket(
        accept4(listener_.number(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) return;
    if (!is_own_user(socket.number())) continue;
    connections_.push_back(
        {std::make_shared<wire::Descriptor>(std::move(socket)), Clock::now() + kTicketTime});
  }
  // More wait in the backlog, but must not keep the thread awake.
  wire::Descriptor(accept4(listener_.number(), nullptr, nullptr, SOCK_CLOEXEC)).close();
}

bool LeaseSocket::receive(Connection& connection) {
  if (!connection.segment) return take_ticket(connection);
  const wire::ReceivedMessage received = wire::receive_message(connection.socket->number());
  if (received.kind == wire::ReceivedMessage::Kind::nothing_yet) return true;
  return received.kind == wire::ReceivedMessage::Kind::message &&
         received.message == wire::LeaseMessage::mapped && take_mapped(connection);
}

bool LeaseSocket::take_ticket(Connection& connection) {
  std::array<char, wire::kTicketBytes + 1> ticket{};
  const ssize_t size =
      recv(connection.socket->number(), ticket.data(), ticket.size(), MSG_DONTWAIT);
  if (size != wire::kTicketBytes) return size < 0 && (errno == EAGAIN || errno == EINTR);
  connection.segment = leases_.redeem({ticket.data(), wire::kTicketBytes});
  if (!connection.segment) return false;
  connection.deadline = Clock::now() + kMappingTime;
  const wire::Descriptor foreign = connection.segment->take_foreign_descriptor();
  return wire::send_message(connection.socket->number(), wire::LeaseMessage::descriptor,
                            foreign.number());
}

bool LeaseSocket::take_mapped(Connection& connection) {
  if (connection.segment->sealed()) return false;  // said twice
  try {
    connection.segment->seal();
  } catch (const Error&) {
    return false;
  }
  connection.deadline = Clock::time_point::max();
  copies_.post([&copies = copies_, &pages = pages_, socket = connection.socket,
                segment = connection.segment] { populate(copies, pages, socket, segment, 0); });
  return true;
}

bool LeaseSocket::check(Connection& connection, Clock::time_point now) const {
  if (now >= connection.deadline) return connection.segment && connection.segment->used();
  if (!connection.segment || connection.told) return true;
  SharedSegment& segment = *connection.segment;
  if (segment.idle_for(now) > idle_timeout_) segment.recall();
  if (!segment.recalled() || !segment.advertised()) return true;
  connection.told = true;
  connection.deadline = now + kReturnTime;
  return wire::send_message(connection.socket->number(), wire::LeaseMessage::recalled);
}

}  // namespace meshsmooth::server
