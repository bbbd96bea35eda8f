#include "memory_budget.hpp"

#include <algorithm>
#include <string>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

void check_limit(std::int64_t need, std::int64_t limit, const std::string& space) {
  if (need <= limit) return;
  throw OutOfMemory("MESH_TOO_LARGE",
                    "the job needs " + std::to_string(need) + " bytes of " + space +
                        " memory, the limit of this server is " + std::to_string(limit),
                    {{"need_bytes", std::to_string(need)},
                     {"limit_bytes", std::to_string(limit)},
                     {"space", space}});
}

[[noreturn]] void throw_busy(const std::string& reason, std::int64_t need, std::int64_t free,
                             const std::string& space, const DrainRate& freed) {
  throw Busy(reason,
             "the job needs " + std::to_string(need) + " bytes of " + space + " memory, " +
                 std::to_string(free) + " are free now; try again later",
             {{"need_bytes", std::to_string(need)}, {"free_bytes", std::to_string(free)}},
             freed.time_for(static_cast<double>(need - free), DrainRate::Clock::now()));
}

}  // namespace

Reservation::~Reservation() {
  if (budget_ != nullptr) budget_->release(bytes_, device_);
}

void Reservation::grow(std::int64_t host_bytes) {
  if (budget_ == nullptr) return;
  budget_->grow(bytes_, host_bytes);
  bytes_.host_bytes += host_bytes;
}

Reservation Reservation::split(MemoryEstimate part) {
  part = {std::min(part.host_bytes, bytes_.host_bytes),
          std::min(part.device_bytes, bytes_.device_bytes)};
  bytes_.host_bytes -= part.host_bytes;
  bytes_.device_bytes -= part.device_bytes;
  return {budget_, part, device_};
}

MemoryBudget::MemoryBudget(MemoryBytes limit)
    : limit_(std::move(limit)),
      reserved_{0, std::vector<std::int64_t>(limit_.device_bytes.size())},
      device_freed_(limit_.device_bytes.size()),
      closed_(limit_.device_bytes.size()) {}

void MemoryBudget::check_fits(MemoryEstimate need) const {
  check_limit(need.host_bytes, limit_.host_bytes, "host");
  check_limit(need.device_bytes, *std::ranges::max_element(limit_.device_bytes), "device");
}

Reservation MemoryBudget::reserve(MemoryEstimate need, std::span<const int> preferred) {
  check_fits(need);
  const std::lock_guard lock(mutex_);
  return take(choose_device(need.device_bytes, preferred), need);
}

Reservation MemoryBudget::reserve_on(int device, MemoryEstimate need) {
  check_limit(need.host_bytes, limit_.host_bytes, "host");
  check_limit(need.device_bytes, limit_.device_bytes[device], "device");
  const std::lock_guard lock(mutex_);
  return take(device, need);
}

std::int64_t MemoryBudget::free_bytes(int device) const {
  if (closed_[static_cast<std::size_t>(device)]) return -1;  // less than any job needs
  return limit_.device_bytes[device] - reserved_.device_bytes[device];
}

bool MemoryBudget::close_device(int device) {
  const std::lock_guard lock(mutex_);
  closed_[static_cast<std::size_t>(device)] = true;
  return std::ranges::all_of(closed_, [](bool closed) { return closed; });
}

bool MemoryBudget::closed(int device) const {
  const std::lock_guard lock(mutex_);
  return closed_[static_cast<std::size_t>(device)];
}

int MemoryBudget::choose_device(std::int64_t need, std::span<const int> preferred) const {
  for (const int device : preferred) {
    if (need <= free_bytes(device)) return device;
  }
  int best = 0, freest = 0;
  for (int device = 0; device < static_cast<int>(limit_.device_bytes.size()); ++device) {
    const bool fits = need <= free_bytes(device);
    if (fits && (need > free_bytes(best) ||
                 reserved_.device_bytes[device] < reserved_.device_bytes[best])) {
      best = device;
    }
    if (free_bytes(device) > free_bytes(freest)) freest = device;
  }
  return need <= free_bytes(best) ? best : freest;
}

Reservation MemoryBudget::take(int device, MemoryEstimate need) {
  if (closed_[static_cast<std::size_t>(device)]) {
    throw DeviceError("DEVICE_LOST", "the device has no lane left", true);
  }
  const std::int64_t host_free =
      std::max<std::int64_t>(limit_.host_bytes - reserved_.host_bytes, 0);
  if (need.host_bytes > host_free) {
    throw_busy("HOST_MEMORY_BUSY", need.host_bytes, host_free, "host", host_freed_);
  }
  if (need.device_bytes > free_bytes(device)) {
    throw_busy("DEVICE_MEMORY_BUSY", need.device_bytes, free_bytes(device), "device",
               device_freed_[device]);
  }
  reserved_.host_bytes += need.host_bytes;
  reserved_.device_bytes[device] += need.device_bytes;
  return {this, need, device};
}

void MemoryBudget::grow(MemoryEstimate held, std::int64_t host_bytes) {
  check_limit(held.host_bytes + host_bytes, limit_.host_bytes, "host");
  const std::lock_guard lock(mutex_);
  reserved_.host_bytes += host_bytes;
}

MemoryBytes MemoryBudget::reserved() const {
  const std::lock_guard lock(mutex_);
  return reserved_;
}

void MemoryBudget::release(MemoryEstimate bytes, int device) {
  const std::lock_guard lock(mutex_);
  reserved_.host_bytes -= bytes.host_bytes;
  reserved_.device_bytes[device] -= bytes.device_bytes;
  const auto now = DrainRate::Clock::now();
  host_freed_.add(static_cast<double>(bytes.host_bytes), now);
  device_freed_[device].add(static_cast<double>(bytes.device_bytes), now);
}

}  // namespace meshsmooth::server
