#include "ledger.hpp"

#include <algorithm>
#include <string>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

void check_limit(std::int64_t need, std::int64_t limit, const std::string& space) {
  if (need <= limit) return;
  throw OutOfMemory("MESH_TOO_LARGE",
                    "the job needs " + std::to_string(need) + " bytes of " + space +
                        " memory, this server has " + std::to_string(limit),
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
  if (ledger_ != nullptr) ledger_->give_back(bytes_);
}

Reservation Reservation::split(MemoryEstimate part) {
  part = {std::min(part.host_bytes, bytes_.host_bytes),
          std::min(part.device_bytes, bytes_.device_bytes)};
  bytes_.host_bytes -= part.host_bytes;
  bytes_.device_bytes -= part.device_bytes;
  return {ledger_, part};
}

void Ledger::check_fits(MemoryEstimate need) const {
  check_limit(need.host_bytes, limit_.host_bytes, "host");
  check_limit(need.device_bytes, limit_.device_bytes, "device");
}

Reservation Ledger::reserve(MemoryEstimate need) {
  check_fits(need);
  const std::lock_guard lock(mutex_);
  const std::int64_t host_free = limit_.host_bytes - reserved_.host_bytes;
  const std::int64_t device_free = limit_.device_bytes - reserved_.device_bytes;
  if (need.host_bytes > host_free) {
    throw_busy("HOST_MEMORY_BUSY", need.host_bytes, host_free, "host", host_freed_);
  }
  if (need.device_bytes > device_free) {
    throw_busy("DEVICE_MEMORY_BUSY", need.device_bytes, device_free, "device", device_freed_);
  }
  reserved_.host_bytes += need.host_bytes;
  reserved_.device_bytes += need.device_bytes;
  return {this, need};
}

MemoryEstimate Ledger::reserved() const {
  const std::lock_guard lock(mutex_);
  return reserved_;
}

void Ledger::give_back(MemoryEstimate bytes) {
  const std::lock_guard lock(mutex_);
  reserved_.host_bytes -= bytes.host_bytes;
  reserved_.device_bytes -= bytes.device_bytes;
  const auto now = DrainRate::Clock::now();
  host_freed_.add(static_cast<double>(bytes.host_bytes), now);
  device_freed_.add(static_cast<double>(bytes.device_bytes), now);
}

}  // namespace meshsmooth::server
