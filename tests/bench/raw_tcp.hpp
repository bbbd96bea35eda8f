#pragma once

#include <cstddef>
#include <vector>

namespace meshsmooth::bench {

/// The yardstick of the transport: bytes over one TCP connection of the loopback device, and
/// nothing else.
struct RawListener {
  int socket, port;
};
[[nodiscard]] RawListener listen_raw();

/// Takes transfers of one connection into memory that stays warm.
void serve_raw(int listener);

/// The other side.
class RawClient {
 public:
  explicit RawClient(int port);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  struct Seconds {
    double up, down;
  };
  Seconds move(std::size_t up, std::size_t down);

 private:
  const int socket_;
  std::vector<std::byte> memory_;
};

}  // namespace meshsmooth::bench
