#include "tcp_traffic.hpp"

#include <linux/tcp.h>  // glibc's has no counts of bytes, and excludes this one
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstddef>
#include <fstream>

namespace meshsmooth::server {

std::optional<TcpTraffic> tcp_traffic(int descriptor) {
  int unread = 0;  // asked for first: the difference is not too small
  if (ioctl(descriptor, FIONREAD, &unread) != 0) return std::nullopt;
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 ||
      size < offsetof(tcp_info, tcpi_bytes_sent) + sizeof info.tcpi_bytes_sent) {
    return std::nullopt;
  }
  const auto kept = std::min<std::uint64_t>(info.tcpi_bytes_received, unread);
  return TcpTraffic{info.tcpi_bytes_received - kept, info.tcpi_bytes_sent};
}

std::uint64_t max_receive_buffer_bytes() {
  std::ifstream file("/proc/sys/net/ipv4/tcp_rmem");
  std::uint64_t least = 0, usual = 0, most = 0;
  return file >> least >> usual >> most ? most : 0;
}

}  // namespace meshsmooth::server
