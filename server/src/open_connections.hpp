#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace meshsmooth::server {

/// Connections that the listener has passed on, as long as they are open. Not thread-safe: of the
/// thread that accepts, for meanwhile no connection can get the number of one that has ended.
class OpenConnections {
 public:
  struct Limits {
    std::size_t max_count;
    std::size_t max_count_per_address;
    /// What may be read of a peer while nothing is sent to it; 0: no limit.
    std::uint64_t max_unanswered_bytes;
    /// The same of all peers together, as of now; none: no limit.
    std::function<std::uint64_t()> unanswered_budget_bytes = {};
  };
  explicit OpenConnections(Limits limits) : limits_(std::move(limits)) {}

  /// Whether there may be another one from this address; empty: this host, where a proxy may stand
  /// for many. O(connections).
  [[nodiscard]] bool has_room(const std::string& address);
  void add(int descriptor, std::string address, int port);

  /// Ends those of a peer, "ipv4:HOST:PORT" as gRPC names it, and returns their number.
  int cut(const std::string& peer);

  /// Ends those whose peer floods, and returns their number; where all together exceed the budget,
  /// those with the most. Only frames that HTTP/2 does not control the flow of, as a header without
  /// end, can go on without an answer: for data the server has to open the window again and again.
  /// Such bytes are the worst for a gRPC that keeps them, or (1.83) sizes its buffers by what it
  /// read in one go. Call it every `kWatchInterval` while `watching`; asks the kernel about a
  /// bounded number of connections.
  int cut_floods();
  [[nodiscard]] bool watching() const { return limits_.max_unanswered_bytes > 0 && !open_.empty(); }
  static constexpr auto kWatchInterval = std::chrono::milliseconds(20);

 private:
  using Clock = std::chrono::steady_clock;
  struct Open {
    unsigned long inode;  // another file may have the number since
    std::string address;
    int port;                                      // of the peer
    std::uint64_t read_bytes = 0, sent_bytes = 0;  // when an answer was last seen
    std::uint64_t unanswered_bytes = 0;            // when it was last looked at
  };
  using Entries = std::map<int, Open>;  // by descriptor

  void forget_closed();
  static void look_at(Entries::reference entry);
  void end_flood(Entries::iterator flooding, const std::string& why);
  int cut_largest();

  const Limits limits_;
  Entries open_;
  Clock::time_point counted_{};
  int watched_ = -1;  // the last descriptor that was looked at
};

}  // namespace meshsmooth::server
