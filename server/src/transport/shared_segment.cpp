#include "transport/shared_segment.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

[[noreturn]] void fail(const char* what) {
  throw NotSupported("OPTION_NOT_SUPPORTED",
                     std::string("shared memory: ") + what + ": " + std::strerror(errno));
}

// Opened anew, so that the kernel counts the two descriptions apart: of the one that memfd_create
// gives it counts nothing, and a duplicate would be counted as ours.
wire::Descriptor reopen(const wire::Descriptor& file) {
  const std::string path = "/proc/self/fd/" + std::to_string(file.number());
  wire::Descriptor opened(open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!opened) fail("cannot open the file of a segment anew");
  return opened;
}

wire::Descriptor make_file(std::int64_t size_bytes) {
  wire::Descriptor file(memfd_create("meshsmooth-shared-memory", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file) fail("cannot make the file of a segment");
  if (ftruncate(file.number(), size_bytes) != 0) fail("cannot size the file of a segment");
  if (fcntl(file.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) != 0) {
    fail("cannot seal the file of a segment");
  }
  return file;
}

}  // namespace

SharedSegment::SharedSegment(std::string name, std::string caller, std::int64_t size_bytes,
                             Reservation reservation)
    : name_(std::move(name)),
      caller_(std::move(caller)),
      reservation_(std::move(reservation)),
      last_used_(Clock::now()) {
  const wire::Descriptor file = make_file(size_bytes);
  own_ = reopen(file);
  foreign_ = reopen(file);
  const auto size = static_cast<std::size_t>(size_bytes);
  void* const data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, own_.number(), 0);
  if (data == MAP_FAILED) fail("cannot map a segment");
  bytes_ = {static_cast<std::byte*>(data), size};
  madvise(data, size, MADV_HUGEPAGE);  // helps where shmem_enabled is advise
}

SharedSegment::~SharedSegment() {
  if (unlock_) unlock_(bytes_.data());
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

bool SharedSegment::supported() {
  try {
    SharedSegment segment("", "", whole_pages(1), {});
    if (!segment.in_foreign_use()) return false;  // it does not see our other descriptor
    segment.take_foreign_descriptor().close();
    segment.seal();
    return !segment.in_foreign_use();
  } catch (const Error&) {
    return false;
  }
}

std::int64_t SharedSegment::whole_pages(std::int64_t bytes) {
  const std::int64_t page = sysconf(_SC_PAGESIZE);
  return bytes > INT64_MAX - page ? INT64_MAX / page * page : (bytes + page - 1) / page * page;
}

void SharedSegment::seal() {
  if (fcntl(own_.number(), F_ADD_SEALS, F_SEAL_FUTURE_WRITE | F_SEAL_SEAL) != 0) {
    fail("cannot seal the file of a segment for good");
  }
  sealed_ = true;
}

void SharedSegment::populate(std::span<std::byte> part) const {
  madvise(part.data(), part.size(), MADV_POPULATE_WRITE);  // else at their first use
}

void SharedSegment::open_to_devices(const StagingMemory::PageLock& pages) {
  if (pages.lock) {
    if (!pages.lock(bytes_.data(), bytes_.size())) return;
    unlock_ = pages.unlock;
  }
  open_to_devices_ = true;
}

bool SharedSegment::in_foreign_use() const {
  // The kernel grants a lease for writing only while nobody else has the file open, and maps count
  // as that. Who opens it in the moment until the lease is given back would have us sent a signal,
  // so it is one that is ignored.
  fcntl(own_.number(), F_SETSIG, SIGURG);
  if (fcntl(own_.number(), F_SETLEASE, F_WRLCK) != 0) return true;
  fcntl(own_.number(), F_SETLEASE, F_UNLCK);
  return false;
}

std::shared_ptr<SharedSegment> SharedSegment::use(const std::shared_ptr<SharedSegment>& segment) {
  ++segment->use_count_;
  return {segment.get(), [segment](SharedSegment* used) {
            used->last_used_ = Clock::now();
            --used->use_count_;
          }};
}

SharedSegment::Clock::duration SharedSegment::idle_for(Clock::time_point now) const {
  return used() ? Clock::duration::zero() : now - last_used_.load();
}

}  // namespace meshsmooth::server
