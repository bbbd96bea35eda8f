#pragma once

#include <cstddef>
#include <cstdint>

#include "wire/descriptor.hpp"

/// The conversation on the Unix socket by which a caller gets its segment (docs/protocol.md, Shared
/// memory). Each message is one packet of a SOCK_SEQPACKET socket.
namespace meshsmooth::wire {

/// The first message, from the caller.
inline constexpr std::size_t kTicketBytes = 32;

/// All others: one byte.
enum class LeaseMessage : std::uint8_t {
  descriptor = 1,  // from the server, with the segment's descriptor
  mapped = 2,      // from the caller: from now on nobody can map it for writing
  ready = 3,       // from the server: jobs may name it
  recalled = 4,    // from the server: close the socket and unmap as soon as no job uses it
};

/// False when the peer is gone or does not read. Never blocks, raises no signal.
bool send_message(int socket, LeaseMessage message, int descriptor = -1);

struct ReceivedMessage {
  enum class Kind { message, nothing_yet, end } kind = Kind::end;
  LeaseMessage message{};
  Descriptor descriptor{};
};
/// Receives without waiting; a packet that is no message counts as the end.
[[nodiscard]] ReceivedMessage receive_message(int socket);

}  // namespace meshsmooth::wire
