#pragma once

#include <memory>
#include <optional>
#include <string>

#include "meshsmooth/server_config.hpp"
#include "region/copy_threads.hpp"
#include "region/region_leases.hpp"
#include "region/region_socket.hpp"
#include "socket_folder.hpp"

namespace meshsmooth::server {

/// Memory shared with callers on this host: leases, their socket, and the threads that copy.
/// Thread-safe.
class RegionService {
 public:
  /// The budget must outlive it. `pages`: see Region. Throws InvalidOption (OPTION_OUT_OF_RANGE).
  RegionService(const ServerConfig& config, MemoryBudget& budget, StagingMemory::PageLock pages);

  /// Nothing where the configuration or the kernel has no shared memory.
  [[nodiscard]] static std::unique_ptr<RegionService> make(const ServerConfig& config,
                                                           MemoryBudget& budget,
                                                           StagingMemory::PageLock pages);

  /// See RegionLeases.
  [[nodiscard]] RegionLeases::Lease lease(const std::string& caller, const std::string& share,
                                          std::int64_t size_bytes);
  [[nodiscard]] std::shared_ptr<Region> find(const std::string& caller,
                                             const std::string& name) const {
    return leases_.find(caller, name);
  }
  [[nodiscard]] RegionLeases::Bytes bytes() const { return leases_.bytes(); }
  [[nodiscard]] std::int64_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] const std::string& socket_path() const { return path_; }
  [[nodiscard]] CopyThreads& copies() { return copies_; }

  /// Asks for the regions that no job uses: their memory is needed.
  void want_back_idle();
  /// Asks for all of them: the server drains.
  void want_back();
  /// Ends all leases and removes the socket, once.
  void close();

 private:
  std::optional<SocketFolder> folder_;
  const std::string path_;
  const std::int64_t max_bytes_;
  const StagingMemory::PageLock pages_;
  RegionLeases leases_;
  CopyThreads copies_;
  RegionSocket socket_;
};

}  // namespace meshsmooth::server
