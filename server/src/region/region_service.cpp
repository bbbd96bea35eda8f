#include "region/region_service.hpp"

#include <string_view>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

constexpr std::string_view kScheme = "unix:";

// Locking a very large region would hold up a thread, and the device's driver, for long.
StagingMemory::PageLock up_to(std::int64_t max_bytes, StagingMemory::PageLock pages) {
  if (!pages.lock) return pages;
  return {.lock =
              [max_bytes, lock = std::move(pages.lock)](void* data, std::size_t bytes) {
                return static_cast<std::int64_t>(bytes) <= max_bytes && lock(data, bytes);
              },
          .unlock = std::move(pages.unlock)};
}

}  // namespace

RegionService::RegionService(const ServerConfig& config, MemoryBudget& budget,
                             StagingMemory::PageLock pages)
    : folder_(config.region_socket == kScheme ? std::make_optional<SocketFolder>("region-socket")
                                              : std::nullopt),
      path_((folder_ ? folder_->address() : config.region_socket).substr(kScheme.size())),
      max_bytes_(config.max_region_bytes),
      pages_(up_to(config.idle_pinned_bytes, std::move(pages))),
      leases_(budget, {config.max_region_bytes, config.max_bytes_per_caller}),
      socket_(path_, leases_, copies_, pages_, config.region_idle_timeout) {}

std::unique_ptr<RegionService> RegionService::make(const ServerConfig& config, MemoryBudget& budget,
                                                   StagingMemory::PageLock pages) {
  // Without an address callers are of this process, whose memory is shared anyway.
  if (config.listen.empty() || config.region_socket.empty() || !Region::supported()) return nullptr;
  try {
    return std::make_unique<RegionService>(config, budget, std::move(pages));
  } catch (const Error&) {
    // Nobody asked for it, and the file system may be read-only.
    if (config.region_socket == kScheme) return nullptr;
    throw;
  }
}

RegionLeases::Lease RegionService::lease(const std::string& caller, const std::string& share,
                                         std::int64_t size_bytes) {
  RegionLeases::Lease lease = leases_.lease(caller, share, size_bytes);
  socket_.wake();  // the ticket expires
  return lease;
}

void RegionService::want_back_idle() {
  leases_.want_back_idle();
  socket_.wake();
}

void RegionService::close() {
  socket_.close();
  if (folder_) folder_->remove();
}

void RegionService::want_back() {
  leases_.want_back();
  socket_.wake();
}

}  // namespace meshsmooth::server
