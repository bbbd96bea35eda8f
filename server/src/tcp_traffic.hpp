#pragma once

#include <cstdint>
#include <optional>

namespace meshsmooth::server {

/// What a TCP connection has carried since it began.
struct TcpTraffic {
  std::uint64_t read_bytes;  // by this process, not only received
  std::uint64_t sent_bytes;
};

/// Nothing for other files and sockets.
[[nodiscard]] std::optional<TcpTraffic> tcp_traffic(int descriptor);

/// The most that the kernel keeps of a connection for its reader; 0: unknown.
[[nodiscard]] std::uint64_t max_receive_buffer_bytes();

}  // namespace meshsmooth::server
