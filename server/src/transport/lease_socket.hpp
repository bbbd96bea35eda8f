#pragma once

#include <atomic>
#include <chrono>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "transport/copy_threads.hpp"
#include "transport/segment_leases.hpp"
#include "wire/lease_socket.hpp"

namespace meshsmooth::server {

/// The Unix socket by which callers get their segments: one thread for all connections. An open
/// connection is a lease; when it ends, however the caller ended, so does the lease. Only
/// processes of the server's own user are served.
class LeaseSocket {
 public:
  /// Listens on a path, where nothing but a socket may be. All must outlive it. Throws
  /// InvalidOption (OPTION_OUT_OF_RANGE). `pages`: see SharedSegment; `idle_timeout`: after which
  /// an unused segment is recalled.
  LeaseSocket(const std::string& path, SegmentLeases& leases, CopyThreads& copies,
              const StagingMemory::PageLock& pages, std::chrono::nanoseconds idle_timeout);
  ~LeaseSocket() { close(); }
  LeaseSocket(const LeaseSocket&) = delete;
  LeaseSocket& operator=(const LeaseSocket&) = delete;

  /// Has the thread look at what has changed: a lease, or what is recalled.
  void wake() const;
  /// Ends all leases and removes the socket, once.
  void close();

 private:
  using Clock = SharedSegment::Clock;

  struct Connection {
    /// Shared with the thread that populates its segment.
    std::shared_ptr<wire::Descriptor> socket;
    Clock::time_point deadline;  // of the caller's next step
    std::shared_ptr<SharedSegment> segment = nullptr;
    bool told = false;  // that it is recalled
  };

  void run();
  void accept_all();
  /// False: the connection is over.
  [[nodiscard]] bool receive(Connection& connection);
  [[nodiscard]] bool take_ticket(Connection& connection);
  [[nodiscard]] bool take_mapped(Connection& connection);
  /// Whether it may go on: recalls its segment, and ends what its caller left.
  [[nodiscard]] bool check(Connection& connection, Clock::time_point now) const;

  const std::string path_;
  SegmentLeases& leases_;
  CopyThreads& copies_;
  const StagingMemory::PageLock& pages_;
  const std::chrono::nanoseconds idle_timeout_;
  wire::Descriptor listener_, wake_;
  std::list<Connection> connections_;
  std::atomic<bool> stopped_ = false;
  std::thread thread_;
};

}  // namespace meshsmooth::server
