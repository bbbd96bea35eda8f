#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "memory_budget.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::server {

class CopyThreads;
class SharedSegment;

/// How arrays get to jobs, and results to callers, without chunks: through memory that is leased to
/// callers on this host, and threads that copy. Where the configuration or the kernel has no shared
/// memory nothing is leased and nothing found. Thread-safe.
class Transport {
 public:
  /// The budget must outlive it. `pages`: see SharedSegment. Throws InvalidOption
  /// (OPTION_OUT_OF_RANGE).
  Transport(const ServerConfig& config, MemoryBudget& budget, StagingMemory::PageLock pages);
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  /// The most that is leased; 0: there is nothing to lease.
  [[nodiscard]] std::int64_t max_bytes() const;

  struct Lease {
    std::string name, socket_path, ticket;
    std::int64_t size_bytes;
  };
  /// Needs `max_bytes() > 0`. See SegmentLeases::lease.
  [[nodiscard]] Lease lease(const std::string& caller, const std::string& share,
                            std::int64_t size_bytes);
  /// Throws NotSupported (OPTION_NOT_SUPPORTED), Error (SHARED_MEMORY_NOT_FOUND).
  [[nodiscard]] std::shared_ptr<SharedSegment> find(const std::string& caller,
                                                    const std::string& name) const;
  /// Needs `max_bytes() > 0`.
  [[nodiscard]] CopyThreads& copies() const;

  /// Of leases that jobs may name or that wait for their ticket; and of those that have ended, but
  /// are still mapped by their callers.
  struct Bytes {
    std::int64_t leased = 0, ended = 0;
  };
  [[nodiscard]] Bytes bytes() const;

  /// See SegmentLeases.
  bool drop_unredeemed(const std::string& share);
  /// Recalls the leases that no job uses: their memory is needed.
  void recall_idle();
  /// Recalls all of them: the server drains.
  void recall();
  /// Ends all leases and removes the socket, once.
  void close();

 private:
  struct SharedMemory;
  const std::unique_ptr<SharedMemory> memory_;  // null: there is none
};

}  // namespace meshsmooth::server
