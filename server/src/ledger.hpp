#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "drain_rate.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::server {

class Ledger;

/// Bytes promised by a ledger, given back on destruction. Move-only; the ledger
/// outlives it.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept
      : ledger_(std::exchange(other.ledger_, nullptr)),
        bytes_(std::exchange(other.bytes_, {})),
        device_(other.device_) {}
  Reservation& operator=(Reservation&& other) noexcept {
    std::swap(ledger_, other.ledger_);
    std::swap(bytes_, other.bytes_);
    std::swap(device_, other.device_);
    return *this;
  }
  ~Reservation();

  [[nodiscard]] MemoryEstimate bytes() const { return bytes_; }
  /// Whose memory its `device_bytes` are.
  [[nodiscard]] int device() const { return device_; }

  /// Takes a part of it, at most all, as a promise of its own.
  [[nodiscard]] Reservation split(MemoryEstimate part);

 private:
  friend class Ledger;
  Reservation(Ledger* ledger, MemoryEstimate bytes, int device)
      : ledger_(ledger), bytes_(bytes), device_(device) {}

  Ledger* ledger_ = nullptr;
  MemoryEstimate bytes_;
  int device_ = 0;
};

/// Of the host and of each device.
struct MemoryBytes {
  std::int64_t host_bytes = 0;
  std::vector<std::int64_t> device_bytes;
};

/// Counts the bytes promised to jobs: the sum of the living reservations equals
/// the counters, always. The only place that says no for memory, and so the one
/// that gives jobs to devices. Thread-safe.
class Ledger {
 public:
  /// Of at least one device.
  explicit Ledger(MemoryBytes limit);

  /// On the first of the `preferred` devices that has room, else on that with the
  /// least promised of those that have. Throws OutOfMemory: MESH_TOO_LARGE
  /// ("need_bytes", "limit_bytes") when it could never fit; Busy: HOST_MEMORY_BUSY
  /// or DEVICE_MEMORY_BUSY when not now.
  [[nodiscard]] Reservation reserve(MemoryEstimate need, std::span<const int> preferred = {});
  /// On this device. Throws the same.
  [[nodiscard]] Reservation reserve_on(int device, MemoryEstimate need);

  /// Throws as `reserve` does when it could never fit.
  void check_fits(MemoryEstimate need) const;

  [[nodiscard]] const MemoryBytes& limit() const { return limit_; }
  [[nodiscard]] MemoryBytes reserved() const;

 private:
  friend class Reservation;
  // With the lock.
  [[nodiscard]] std::int64_t free_bytes(int device) const;
  [[nodiscard]] int choose_device(std::int64_t need, std::span<const int> preferred) const;
  [[nodiscard]] Reservation take(int device, MemoryEstimate need);

  void give_back(MemoryEstimate bytes, int device);

  const MemoryBytes limit_;
  mutable std::mutex mutex_;
  MemoryBytes reserved_;
  DrainRate host_freed_;
  std::vector<DrainRate> device_freed_;
};

}  // namespace meshsmooth::server
