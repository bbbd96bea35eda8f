#include "transport/segment_leases.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>

#include "busy.hpp"
#include "meshsmooth/error.hpp"
#include "wire/lease_socket.hpp"

namespace meshsmooth::server {
namespace {

constexpr auto kTicketTime = std::chrono::seconds(5);
// Each takes two descriptors and a mapping.
constexpr std::size_t kMaxSegments = 128;
constexpr auto kRetryDelay = std::chrono::seconds(1);

std::string random_bytes(std::size_t count) {
  std::string bytes(count, '\0');
  if (getrandom(bytes.data(), count, 0) != static_cast<ssize_t>(count)) {
    throw std::runtime_error("getrandom failed");
  }
  return bytes;
}

std::string random_name() {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string name = "segments/";
  for (const char byte : random_bytes(16)) {
    const auto value = static_cast<unsigned char>(byte);
    name += {kDigits[value >> 4], kDigits[value & 15]};
  }
  return name;
}

void check_size(std::int64_t size_bytes, std::int64_t limit, const std::string& whose) {
  if (size_bytes <= limit) return;
  throw OutOfMemory(
      "MESH_TOO_LARGE",
      "a segment of " + std::to_string(size_bytes) + " bytes exceeds " + whose + " of " +
          std::to_string(limit) + " bytes",
      {{"need_bytes", std::to_string(size_bytes)}, {"limit_bytes", std::to_string(limit)}});
}

}  // namespace

void SegmentLeases::check_limits(const std::string& caller, std::int64_t size_bytes) const {
  std::int64_t all_bytes = 0, caller_bytes = 0;
  const auto add = [&](const SharedSegment& segment) {
    all_bytes += segment.size_bytes();
    if (segment.caller() == caller) caller_bytes += segment.size_bytes();
  };
  for (const auto& [key, segment] : leased_) add(*segment);
  for (const auto& segment : ended_) add(*segment);
  if (limits_.max_bytes_per_caller != 0 &&
      size_bytes > limits_.max_bytes_per_caller - caller_bytes) {
    throw OutOfMemory("QUOTA_EXCEEDED",
                      "the segments of one caller may have " +
                          std::to_string(limits_.max_bytes_per_caller) + " bytes",
                      {{"limit_bytes", std::to_string(limits_.max_bytes_per_caller)}});
  }
  const std::int64_t free = limits_.max_bytes - all_bytes;
  if (size_bytes <= free && leased_.size() + ended_.size() < kMaxSegments) return;
  throw Busy("HOST_MEMORY_BUSY", "other segments use the memory that this server shares; try later",
             {{"need_bytes", std::to_string(size_bytes)}, {"free_bytes", std::to_string(free)}},
             kRetryDelay);
}

// The oldest lease of the one who has the most that wait for their tickets: more than `share`.
std::shared_ptr<SharedSegment> SegmentLeases::take_unredeemed(const std::string& share) {
  std::map<std::string, int> counts;
  for (const auto& [key, ticket] : tickets_) ++counts[ticket.share];
  const auto most =
      std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
  if (most == counts.end() || most->second <= counts[share] + 1) return nullptr;
  auto oldest = tickets_.end();
  for (auto ticket = tickets_.begin(); ticket != tickets_.end(); ++ticket) {
    if (ticket->second.share == most->first &&
        (oldest == tickets_.end() || ticket->second.expires < oldest->second.expires)) {
      oldest = ticket;
    }
  }
  std::shared_ptr<SharedSegment> segment = std::move(oldest->second.segment);
  tickets_.erase(oldest);
  leased_.erase(Key(segment->caller(), segment->name()));
  return segment;
}

SegmentLeases::Lease SegmentLeases::lease(const std::string& caller, const std::string& share,
                                          std::int64_t size_bytes) {
  if (size_bytes <= 0) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "size_bytes: it must be above 0",
                        {{"field", "size_bytes"}});
  }
  check_size(size_bytes, limits_.max_bytes, "the memory that this server shares,");
  if (limits_.max_bytes_per_caller != 0) {
    check_size(size_bytes, limits_.max_bytes_per_caller, "the limit for one caller,");
  }
  const std::int64_t whole = SharedSegment::whole_pages(size_bytes);
  Lease lease{nullptr, random_bytes(wire::kTicketBytes)};
  const std::lock_guard lock(mutex_);
  for (;;) {
    try {
      check_limits(caller, size_bytes);
      break;
    } catch (const Busy&) {
      if (!take_unredeemed(share)) throw;  // nobody has written to it: quick to unmap
    }
  }
  lease.segment = std::make_shared<SharedSegment>(random_name(), caller, whole,
                                                  budget_.reserve({.host_bytes = whole}));
  leased_.emplace(Key(caller, lease.segment->name()), lease.segment);
  tickets_.emplace(lease.ticket, Ticket{lease.segment, Clock::now() + kTicketTime, share});
  return lease;
}

bool SegmentLeases::drop_unredeemed(const std::string& share) {
  const std::lock_guard lock(mutex_);
  return take_unredeemed(share) != nullptr;
}

std::shared_ptr<SharedSegment> SegmentLeases::redeem(const std::string& ticket) {
  const std::lock_guard lock(mutex_);
  const auto node = tickets_.extract(ticket);
  return node ? node.mapped().segment : nullptr;
}

void SegmentLeases::end(const SharedSegment& segment) {
  const std::lock_guard lock(mutex_);
  const auto node = leased_.extract(Key(segment.caller(), segment.name()));
  if (node) ended_.push_back(std::move(node.mapped()));
}

std::shared_ptr<SharedSegment> SegmentLeases::find(const std::string& caller,
                                                   const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = leased_.find(Key(caller, name));
  if (found == leased_.end() || !found->second->sealed()) {
    throw Error("SHARED_MEMORY_NOT_FOUND",
                "segment not found or no longer leased; send the mesh in chunks", {{"name", name}});
  }
  return SharedSegment::use(found->second);
}

void SegmentLeases::recall_idle() {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, segment] : leased_) {
    if (!segment->used()) segment->recall();
  }
}

void SegmentLeases::recall() {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, segment] : leased_) segment->recall();
}

void SegmentLeases::sweep(Clock::time_point now) {
  std::vector<std::shared_ptr<SharedSegment>> released;  // unmapped without the lock
  const std::lock_guard lock(mutex_);
  for (auto ticket = tickets_.begin(); ticket != tickets_.end();) {
    if (now < ticket->second.expires) {
      ++ticket;
      continue;
    }
    const SharedSegment& segment = *ticket->second.segment;
    ended_.push_back(ticket->second.segment);
    leased_.erase(Key(segment.caller(), segment.name()));
    static_cast<void>(ended_.back()->take_foreign_descriptor());
    ticket = tickets_.erase(ticket);
  }
  std::erase_if(ended_, [&](const std::shared_ptr<SharedSegment>& segment) {
    if (segment.use_count() > 1 || segment->used() || segment->in_foreign_use()) return false;
    released.push_back(segment);
    return true;
  });
}

bool SegmentLeases::unsettled() const {
  const std::lock_guard lock(mutex_);
  return !tickets_.empty() || !ended_.empty();
}

SegmentLeases::Bytes SegmentLeases::bytes() const {
  const std::lock_guard lock(mutex_);
  Bytes bytes;
  for (const auto& [key, segment] : leased_) bytes.leased += segment->size_bytes();
  for (const auto& segment : ended_) bytes.ended += segment->size_bytes();
  return bytes;
}

}  // namespace meshsmooth::server
