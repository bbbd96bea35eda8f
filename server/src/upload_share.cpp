#include "upload_share.hpp"

#include "busy.hpp"

namespace meshsmooth::server {

void UploadShares::check(std::int64_t held, std::int64_t need, std::int64_t limit,
                         std::string_view space, const DrainRate& freed) const {
  if (need <= limit - held) return;
  throw Busy("QUOTA_EXCEEDED",
             what_ + " hold " + std::to_string(held) + " bytes of " + std::string(space) +
                 " memory, " + std::to_string(need) + " more would exceed the limit of " +
                 std::to_string(limit) + "; finish one of them first",
             {{"limit_bytes", std::to_string(limit)}, {"space", std::string(space)}},
             freed.time_for(static_cast<double>(need - (limit - held)), DrainRate::Clock::now()));
}

UploadShare::~UploadShare() {
  if (shares_ != nullptr) shares_->release(connection_, bytes_);
}

UploadShare UploadShares::take(const std::string& connection, MemoryEstimate need) {
  if (connection.empty()) return {};
  const std::lock_guard lock(mutex_);
  const auto found = held_.find(connection);
  if (found != held_.end()) {
    check(found->second.bytes.host_bytes, need.host_bytes, limit_.host_bytes, "host", host_freed_);
    check(found->second.bytes.device_bytes, need.device_bytes, limit_.device_bytes, "device",
          device_freed_);
  }
  Held& held = held_[connection];
  ++held.uploads;
  held.bytes.host_bytes += need.host_bytes;
  held.bytes.device_bytes += need.device_bytes;
  return {this, connection, need};
}

void UploadShares::release(const std::string& connection, MemoryEstimate bytes) {
  const std::lock_guard lock(mutex_);
  const auto held = held_.find(connection);
  held->second.bytes.host_bytes -= bytes.host_bytes;
  held->second.bytes.device_bytes -= bytes.device_bytes;
  if (--held->second.uploads == 0) held_.erase(held);
  const auto now = DrainRate::Clock::now();
  host_freed_.add(static_cast<double>(bytes.host_bytes), now);
  device_freed_.add(static_cast<double>(bytes.device_bytes), now);
}

}  // namespace meshsmooth::server
