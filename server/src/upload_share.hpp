#pragma once

#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "drain_rate.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::server {

class UploadShares;

/// Counts the memory of one upload, job or stream against the share of its connection or caller;
/// returned on destruction. Move-only; the `UploadShares` outlives it.
class UploadShare {
 public:
  UploadShare() = default;
  UploadShare(UploadShare&& other) noexcept
      : shares_(std::exchange(other.shares_, nullptr)),
        connection_(std::move(other.connection_)),
        bytes_(other.bytes_) {}
  UploadShare& operator=(UploadShare&& other) noexcept {
    std::swap(shares_, other.shares_);
    std::swap(connection_, other.connection_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~UploadShare();

 private:
  friend class UploadShares;
  UploadShare(UploadShares* shares, std::string connection, MemoryEstimate bytes)
      : shares_(shares), connection_(std::move(connection)), bytes_(bytes) {}

  UploadShares* shares_ = nullptr;
  std::string connection_;
  MemoryEstimate bytes_;
};

/// Limits the memory that the unfinished uploads of one connection, or all jobs or streams of one
/// caller, reserve together, so that a client whose uploads stall cannot take the memory of all
/// others. A connection always gets one upload, of any size. Thread-safe.
class UploadShares {
 public:
  /// `limit`: of each connection. `what` it limits, for the error.
  explicit UploadShares(MemoryEstimate limit,
                        std::string what = "the unfinished uploads of this connection")
      : limit_(limit), what_(std::move(what)) {}

  /// An empty `connection` is not limited. Throws Busy (QUOTA_EXCEEDED). O(log connections).
  [[nodiscard]] UploadShare take(const std::string& connection, MemoryEstimate need);

 private:
  friend class UploadShare;
  void release(const std::string& connection, MemoryEstimate bytes);
  // With the lock.
  void check(std::int64_t held, std::int64_t need, std::int64_t limit, std::string_view space,
             const DrainRate& freed) const;

  struct Held {
    int uploads = 0;
    MemoryEstimate bytes;
  };
  const MemoryEstimate limit_;
  const std::string what_;
  std::mutex mutex_;
  std::map<std::string, Held> held_;  // by connection
  DrainRate host_freed_, device_freed_;
};

}  // namespace meshsmooth::server
