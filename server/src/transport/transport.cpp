#include "transport/transport.hpp"

#include <optional>
#include <string_view>
#include <utility>

#include "meshsmooth/error.hpp"
#include "socket_folder.hpp"
#include "transport/copy_threads.hpp"
#include "transport/lease_socket.hpp"
#include "transport/segment_leases.hpp"

namespace meshsmooth::server {
namespace {

constexpr std::string_view kScheme = "unix:";

// Locking a very large segment would hold up a thread, and the device's driver, for long.
StagingMemory::PageLock up_to(std::int64_t max_bytes, StagingMemory::PageLock pages) {
  if (!pages.lock) return pages;
  return {.lock =
              [max_bytes, lock = std::move(pages.lock)](void* data, std::size_t bytes) {
                return static_cast<std::int64_t>(bytes) <= max_bytes && lock(data, bytes);
              },
          .unlock = std::move(pages.unlock)};
}

}  // namespace

/// The leases, their socket, and the threads that copy.
struct Transport::SharedMemory {
  SharedMemory(const ServerConfig& config, MemoryBudget& budget, StagingMemory::PageLock page_lock)
      : folder(config.shared_memory_socket == kScheme
                   ? std::make_optional<SocketFolder>("shared-memory-socket")
                   : std::nullopt),
        path((folder ? folder->address() : config.shared_memory_socket).substr(kScheme.size())),
        max_bytes(config.max_shared_memory_bytes),
        pages(up_to(config.idle_pinned_bytes, std::move(page_lock))),
        leases(budget, {config.max_shared_memory_bytes, config.max_bytes_per_caller}),
        socket(path, leases, copies, pages, config.shared_memory_idle_timeout) {}

  /// Nothing where the configuration or the kernel has no shared memory.
  static std::unique_ptr<SharedMemory> make(const ServerConfig& config, MemoryBudget& budget,
                                            StagingMemory::PageLock pages) {
    // Without an address callers are of this process, whose memory is shared anyway.
    if (config.listen.empty() || config.shared_memory_socket.empty()) return nullptr;
    if (!SharedSegment::supported()) return nullptr;
    try {
      return std::make_unique<SharedMemory>(config, budget, std::move(pages));
    } catch (const Error&) {
      // Nobody asked for it, and the file system may be read-only.
      if (config.shared_memory_socket == kScheme) return nullptr;
      throw;
    }
  }

  std::optional<SocketFolder> folder;
  const std::string path;
  const std::int64_t max_bytes;
  const StagingMemory::PageLock pages;
  SegmentLeases leases;
  CopyThreads copies;
  LeaseSocket socket;
};

Transport::Transport(const ServerConfig& config, MemoryBudget& budget,
                     StagingMemory::PageLock pages)
    : memory_(SharedMemory::make(config, budget, std::move(pages))) {}

Transport::~Transport() = default;

std::int64_t Transport::max_bytes() const { return memory_ ? memory_->max_bytes : 0; }

Transport::Lease Transport::lease(const std::string& caller, const std::string& share,
                                  std::int64_t size_bytes) {
  SegmentLeases::Lease lease = memory_->leases.lease(caller, share, size_bytes);
  memory_->socket.wake();  // the ticket expires
  return {.name = lease.segment->name(),
          .socket_path = memory_->path,
          .ticket = std::move(lease.ticket),
          .size_bytes = lease.segment->size_bytes()};
}

std::shared_ptr<SharedSegment> Transport::find(const std::string& caller,
                                               const std::string& name) const {
  if (memory_) return memory_->leases.find(caller, name);
  throw NotSupported("OPTION_NOT_SUPPORTED", "shared_memory: this server shares no memory",
                     {{"field", "shared_memory"}});
}

CopyThreads& Transport::copies() const { return memory_->copies; }

Transport::Bytes Transport::bytes() const {
  if (!memory_) return {};
  const SegmentLeases::Bytes bytes = memory_->leases.bytes();
  return {.leased = bytes.leased, .ended = bytes.ended};
}

bool Transport::drop_unredeemed(const std::string& share) {
  return memory_ && memory_->leases.drop_unredeemed(share);
}

void Transport::recall_idle() {
  if (!memory_) return;
  memory_->leases.recall_idle();
  memory_->socket.wake();
}

void Transport::recall() {
  if (!memory_) return;
  memory_->leases.recall();
  memory_->socket.wake();
}

void Transport::close() {
  if (!memory_) return;
  memory_->socket.close();
  if (memory_->folder) memory_->folder->remove();
}

}  // namespace meshsmooth::server
