#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "memory_budget.hpp"
#include "transport/shared_segment.hpp"

namespace meshsmooth::server {

/// All segments, by caller and name, from their lease until nobody has their memory any more. A
/// segment is leased once: nothing that one caller wrote is ever shown to another. Thread-safe.
class SegmentLeases {
 public:
  using Clock = SharedSegment::Clock;

  struct Limits {
    std::int64_t max_bytes;             // of all segments
    std::int64_t max_bytes_per_caller;  // 0: no limit
  };
  /// The budget must outlive it.
  SegmentLeases(MemoryBudget& budget, Limits limits) : budget_(budget), limits_(limits) {}

  struct Lease {
    std::shared_ptr<SharedSegment> segment;
    std::string ticket;
  };
  /// A new segment, whose ticket is good for seconds. Throws InvalidOption (OPTION_OUT_OF_RANGE),
  /// OutOfMemory (MESH_TOO_LARGE, QUOTA_EXCEEDED), Busy (HOST_MEMORY_BUSY).
  /// `share`: whose lease it is where callers without a name are told apart. When there is no
  /// room, leases that were not redeemed make it, of whoever has more of them.
  [[nodiscard]] Lease lease(const std::string& caller, const std::string& share,
                            std::int64_t size_bytes);
  /// The segment of a ticket, once; nothing for an unknown one.
  [[nodiscard]] std::shared_ptr<SharedSegment> redeem(const std::string& ticket);
  /// No job can name it any more. Its bytes stay reserved as long as jobs use it or another process
  /// has it.
  void end(const SharedSegment& segment);

  /// One that jobs may name, as a use by a call. Throws Error (SHARED_MEMORY_NOT_FOUND).
  [[nodiscard]] std::shared_ptr<SharedSegment> find(const std::string& caller,
                                                    const std::string& name) const;

  /// Frees at once the memory of a lease whose caller has not come for it, if somebody has more of
  /// these than `share`. False: nobody has.
  bool drop_unredeemed(const std::string& share);
  /// Recalls idle leases.
  void recall_idle();
  /// Recalls all.
  void recall();

  /// Ends what waited too long for its ticket, and releases what nobody has any more.
  void sweep(Clock::time_point now);
  /// Whether `sweep` has anything to wait for.
  [[nodiscard]] bool unsettled() const;

  /// Of segments that jobs may name or that wait for their ticket; and of those that have ended,
  /// but still are somebody's.
  struct Bytes {
    std::int64_t leased = 0, ended = 0;
  };
  [[nodiscard]] Bytes bytes() const;

 private:
  struct Ticket {
    std::shared_ptr<SharedSegment> segment;
    Clock::time_point expires;
    std::string share;
  };
  using Key = std::pair<std::string, std::string>;  // caller, name

  // With the lock.
  void check_limits(const std::string& caller, std::int64_t size_bytes) const;
  [[nodiscard]] std::shared_ptr<SharedSegment> take_unredeemed(const std::string& share);

  MemoryBudget& budget_;
  const Limits limits_;
  mutable std::mutex mutex_;
  std::map<Key, std::shared_ptr<SharedSegment>> leased_;
  std::map<std::string, Ticket> tickets_;
  std::vector<std::shared_ptr<SharedSegment>> ended_;
};

}  // namespace meshsmooth::server
