#include "transport/leased_segment.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "wire/lease_socket.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::client {
namespace {

using wire::LeaseMessage;

constexpr int kStepMilliseconds = 60'000;  // the server populates very large segments

wire::Descriptor connect_to(const std::string& path) {
  const auto address = wire::socket_address(path);
  if (!address) return wire::Descriptor();
  wire::Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (!socket || connect(socket.number(), reinterpret_cast<const sockaddr*>(&*address),
                         sizeof *address) != 0) {
    return wire::Descriptor();
  }
  return socket;
}

/// The message of this kind if it is the next one.
wire::ReceivedMessage await(int socket, LeaseMessage kind, int cancel) {
  std::array<pollfd, 2> events{{{socket, POLLIN, 0}, {cancel, POLLIN, 0}}};
  if (poll(events.data(), events.size(), kStepMilliseconds) <= 0 || events[1].revents != 0) {
    return {};
  }
  wire::ReceivedMessage received = wire::receive_message(socket);
  if (received.message != kind) received.kind = wire::ReceivedMessage::Kind::end;
  return received;
}

bool is_message(const wire::ReceivedMessage& received) {
  return received.kind == wire::ReceivedMessage::Kind::message;
}

/// Empty unless the file has that size for good.
std::span<std::byte> map(const wire::Descriptor& file, std::int64_t size_bytes) {
  struct stat facts {};
  constexpr int kNeeded = F_SEAL_SHRINK | F_SEAL_GROW;
  if (fstat(file.number(), &facts) != 0 || facts.st_size != size_bytes || size_bytes <= 0 ||
      (fcntl(file.number(), F_GET_SEALS) & kNeeded) != kNeeded) {
    return {};
  }
  const auto size = static_cast<std::size_t>(size_bytes);
  void* const data =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file.number(), 0);
  if (data == MAP_FAILED) return {};
  madvise(data, size, MADV_DONTFORK);
  return {static_cast<std::byte*>(data), size};
}

}  // namespace

std::unique_ptr<LeasedSegment> LeasedSegment::fetch(const v1::LeaseSharedMemoryResponse& lease,
                                                    int cancel) {
  wire::Descriptor socket = connect_to(lease.socket_path());
  const std::string& ticket = lease.ticket();
  if (!socket || send(socket.number(), ticket.data(), ticket.size(), MSG_NOSIGNAL) !=
                     static_cast<ssize_t>(ticket.size())) {
    return nullptr;
  }
  wire::ReceivedMessage received = await(socket.number(), LeaseMessage::descriptor, cancel);
  if (!is_message(received) || !received.descriptor) return nullptr;
  const auto bytes = map(received.descriptor, lease.size_bytes());
  if (bytes.empty()) return nullptr;
  std::unique_ptr<LeasedSegment> segment(
      new LeasedSegment(lease.segment_name(), std::move(socket), bytes));
  received.descriptor.close();
  if (!wire::send_message(segment->socket(), LeaseMessage::mapped) ||
      !is_message(await(segment->socket(), LeaseMessage::ready, cancel))) {
    return nullptr;
  }
  return segment;
}

LeasedSegment::LeasedSegment(std::string name, wire::Descriptor socket, std::span<std::byte> bytes)
    : name_(std::move(name)),
      socket_(std::move(socket)),
      guard_(socket_.number()),
      bytes_(bytes),
      process_(getpid()) {}

LeasedSegment::~LeasedSegment() {
  if (getpid() == process_) munmap(bytes_.data(), bytes_.size());
}

bool LeasedSegment::ended() const {
  return wire::receive_message(socket()).kind != wire::ReceivedMessage::Kind::nothing_yet;
}

}  // namespace meshsmooth::client
