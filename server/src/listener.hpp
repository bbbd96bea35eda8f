#pragma once

#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "open_connections.hpp"
#include "wire/descriptor.hpp"

namespace meshsmooth::server {

/// Listens on HOST:PORT or unix:PATH and passes on connections whose peer has begun to send. gRPC's
/// own listener, up to 1.53, never accepts again once descriptors have run out (CVE-2023-4785), and
/// takes as many connections as there are. What it accepts is bounded here: silent peers wait in
/// a set whose oldest member makes room, and the others are counted, all together and for each
/// address.
class Listener {
 public:
  using Clock = std::chrono::steady_clock;

  struct Limits {
    /// Connections that were passed on and are still open.
    std::size_t max_connections = 4096;
    /// The same from one address, unless it is on this host, where a proxy may stand for many.
    std::size_t max_connections_per_address = 1024;
    /// No connection takes a descriptor of this number or above. Descriptors are numbered from the
    /// lowest free one, so fewer than this are ever open.
    int max_descriptor = 1 << 20;
    /// For a peer to send its first byte.
    Clock::duration first_byte_timeout = std::chrono::seconds(20);
    /// For data that the peer does not acknowledge; 0: the system's.
    std::chrono::milliseconds unacknowledged_timeout{0};
    /// See OpenConnections; neither for Unix sockets.
    std::uint64_t max_unanswered_bytes = 0;
    std::function<std::uint64_t()> unanswered_budget_bytes = {};  // called by the listener's thread
  };
  /// Takes the descriptor of a connection, non-blocking. Called by one thread.
  using Accepted = std::function<void(int descriptor, int listener)>;

  /// Binds and listens; serves nobody before `start`. Throws InvalidOption (OPTION_OUT_OF_RANGE)
  /// with the reason. Port 0 selects a free one. A stale socket of a server that was killed is
  /// replaced, a live one is an error. Errors name `setting`.
  Listener(const std::string& address, Limits limits, std::string setting = "listen");
  ~Listener() { close(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  void start(Accepted accepted);
  /// Ends an open connection of a peer, soon; "ipv4:HOST:PORT" as gRPC names peers.
  void cut(const std::string& peer);
  /// Accepts no more, and closes what was not passed on; `Accepted` is not called afterwards.
  void close();

  /// 0 on a Unix socket.
  [[nodiscard]] int port() const { return port_; }
  /// Connections that were refused or gave way to others, so far.
  [[nodiscard]] std::int64_t refused_count() const { return refused_; }

 private:
  struct Silent {  // no byte has come yet
    wire::Descriptor socket;
    std::string address;  // empty on this host
    int port;
    Clock::time_point accepted;
  };

  void listen_on_host(const std::string& address);
  void bind_to(int family, const sockaddr* address, socklen_t size, bool only_this_family);
  void run();
  void accept_from(int listener);
  void pass_on(Silent& peer);
  void wake() const;
  void cut_wanted();

  const Limits limits_;
  const std::string setting_;
  std::vector<wire::Descriptor> listeners_;
  std::string path_;  // of the Unix socket
  int port_ = 0;
  wire::Descriptor wake_;
  std::mutex mutex_;
  std::vector<std::string> to_cut_;  // with the lock
  Accepted accepted_;
  std::list<Silent> silent_;  // the oldest first
  OpenConnections open_;
  Clock::time_point pause_until_{}, next_watch_{};
  std::atomic<std::int64_t> refused_ = 0;
  std::atomic<bool> stopped_ = false;
  std::thread thread_;
};

/// The limit for `Listener::Limits::max_descriptor` that leaves enough to the rest of the process.
[[nodiscard]] int max_connection_descriptor();
/// How many more connections fit below it.
[[nodiscard]] int free_connection_descriptors();

}  // namespace meshsmooth::server
