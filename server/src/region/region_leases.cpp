#include "region/region_leases.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>

#include "busy.hpp"
#include "meshsmooth/error.hpp"
#include "wire/region_socket.hpp"

namespace meshsmooth::server {
namespace {

constexpr auto kTicketTime = std::chrono::seconds(5);
// Each takes two descriptors and a mapping.
constexpr std::size_t kMaxRegions = 128;
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
  std::string name = "regions/";
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
      "a region of " + std::to_string(size_bytes) + " bytes exceeds " + whose + " of " +
          std::to_string(limit) + " bytes",
      {{"need_bytes", std::to_string(size_bytes)}, {"limit_bytes", std::to_string(limit)}});
}

}  // namespace

void RegionLeases::check_limits(const std::string& caller, std::int64_t size_bytes) const {
  std::int64_t all_bytes = 0, caller_bytes = 0;
  const auto add = [&](const Region& region) {
    all_bytes += region.size_bytes();
    if (region.caller() == caller) caller_bytes += region.size_bytes();
  };
  for (const auto& [key, region] : leased_) add(*region);
  for (const auto& region : ended_) add(*region);
  if (limits_.max_bytes_per_caller != 0 &&
      size_bytes > limits_.max_bytes_per_caller - caller_bytes) {
    throw OutOfMemory("QUOTA_EXCEEDED",
                      "the regions of one caller may have " +
                          std::to_string(limits_.max_bytes_per_caller) + " bytes",
                      {{"limit_bytes", std::to_string(limits_.max_bytes_per_caller)}});
  }
  const std::int64_t free = limits_.max_bytes - all_bytes;
  if (size_bytes <= free && leased_.size() + ended_.size() < kMaxRegions) return;
  throw Busy("HOST_MEMORY_BUSY", "other regions use the memory that this server shares; try later",
             {{"need_bytes", std::to_string(size_bytes)}, {"free_bytes", std::to_string(free)}},
             kRetryDelay);
}

// The oldest lease of the one who has the most that wait for their tickets: more than `share`.
std::shared_ptr<Region> RegionLeases::take_unredeemed(const std::string& share) {
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
  std::shared_ptr<Region> region = std::move(oldest->second.region);
  tickets_.erase(oldest);
  leased_.erase(Key(region->caller(), region->name()));
  return region;
}

RegionLeases::Lease RegionLeases::lease(const std::string& caller, const std::string& share,
                                        std::int64_t size_bytes) {
  if (size_bytes <= 0) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "size_bytes: it must be above 0",
                        {{"field", "size_bytes"}});
  }
  check_size(size_bytes, limits_.max_bytes, "the memory that this server shares,");
  if (limits_.max_bytes_per_caller != 0) {
    check_size(size_bytes, limits_.max_bytes_per_caller, "the limit for one caller,");
  }
  const std::int64_t whole = Region::whole_pages(size_bytes);
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
  lease.region = std::make_shared<Region>(random_name(), caller, whole,
                                          budget_.reserve({.host_bytes = whole}));
  leased_.emplace(Key(caller, lease.region->name()), lease.region);
  tickets_.emplace(lease.ticket, Ticket{lease.region, Clock::now() + kTicketTime, share});
  return lease;
}

std::shared_ptr<Region> RegionLeases::redeem(const std::string& ticket) {
  const std::lock_guard lock(mutex_);
  const auto node = tickets_.extract(ticket);
  return node ? node.mapped().region : nullptr;
}

void RegionLeases::end(const Region& region) {
  const std::lock_guard lock(mutex_);
  const auto node = leased_.extract(Key(region.caller(), region.name()));
  if (node) ended_.push_back(std::move(node.mapped()));
}

std::shared_ptr<Region> RegionLeases::find(const std::string& caller,
                                           const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = leased_.find(Key(caller, name));
  if (found == leased_.end() || !found->second->sealed()) {
    throw Error("REGION_NOT_FOUND", "region not found or no longer leased; send the mesh in chunks",
                {{"name", name}});
  }
  return Region::use(found->second);
}

void RegionLeases::want_back_idle() {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, region] : leased_) {
    if (!region->used()) region->want_back();
  }
}

void RegionLeases::want_back() {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, region] : leased_) region->want_back();
}

void RegionLeases::sweep(Clock::time_point now) {
  std::vector<std::shared_ptr<Region>> released;  // unmapped without the lock
  const std::lock_guard lock(mutex_);
  for (auto ticket = tickets_.begin(); ticket != tickets_.end();) {
    if (now < ticket->second.expires) {
      ++ticket;
      continue;
    }
    const Region& region = *ticket->second.region;
    ended_.push_back(ticket->second.region);
    leased_.erase(Key(region.caller(), region.name()));
    static_cast<void>(ended_.back()->take_foreign_descriptor());
    ticket = tickets_.erase(ticket);
  }
  std::erase_if(ended_, [&](const std::shared_ptr<Region>& region) {
    if (region.use_count() > 1 || region->used() || region->in_foreign_use()) return false;
    released.push_back(region);
    return true;
  });
}

bool RegionLeases::unsettled() const {
  const std::lock_guard lock(mutex_);
  return !tickets_.empty() || !ended_.empty();
}

RegionLeases::Bytes RegionLeases::bytes() const {
  const std::lock_guard lock(mutex_);
  Bytes bytes;
  for (const auto& [key, region] : leased_) bytes.leased += region->size_bytes();
  for (const auto& region : ended_) bytes.ended += region->size_bytes();
  return bytes;
}

}  // namespace meshsmooth::server
