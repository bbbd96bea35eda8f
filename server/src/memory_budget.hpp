#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "drain_rate.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::server {

class MemoryBudget;

/// Bytes reserved in a memory budget, released on destruction. Move-only; the budget
/// outlives it.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept
      : budget_(std::exchange(other.budget_, nullptr)),
        bytes_(std::exchange(other.bytes_, {})),
        device_(other.device_) {}
  Reservation& operator=(Reservation&& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
    std::swap(device_, other.device_);
    return *this;
  }
  ~Reservation();

  [[nodiscard]] MemoryEstimate bytes() const { return bytes_; }
  /// The device of its `device_bytes`.
  [[nodiscard]] int device() const { return device_; }

  /// Adds bytes that its running job turns out to need; see `MemoryBudget::grow`.
  void grow(std::int64_t host_bytes);
  /// Splits off a part, at most all of it, as a reservation of its own.
  [[nodiscard]] Reservation split(MemoryEstimate part);

 private:
  friend class MemoryBudget;
  Reservation(MemoryBudget* budget, MemoryEstimate bytes, int device)
      : budget_(budget), bytes_(bytes), device_(device) {}

  MemoryBudget* budget_ = nullptr;
  MemoryEstimate bytes_;
  int device_ = 0;
};

/// Host memory and the memory of each device.
struct MemoryBytes {
  std::int64_t host_bytes = 0;
  std::vector<std::int64_t> device_bytes;
};

/// Counts the bytes reserved for jobs: the counters always equal the sum of the existing
/// reservations. The only place that refuses for lack of memory, and therefore also the one that
/// assigns jobs to devices. Thread-safe.
class MemoryBudget {
 public:
  /// `limit` has at least one device.
  explicit MemoryBudget(MemoryBytes limit);

  /// Reserves on the first of the `preferred` devices that has room, else on the device with the
  /// fewest reserved bytes of those that have. Throws OutOfMemory: MESH_TOO_LARGE
  /// ("need_bytes", "limit_bytes") when it could never fit; Busy: HOST_MEMORY_BUSY
  /// or DEVICE_MEMORY_BUSY when it does not fit now; DeviceError when all devices are closed.
  [[nodiscard]] Reservation reserve(MemoryEstimate need, std::span<const int> preferred = {});
  /// Reserves on this device. Throws the same.
  [[nodiscard]] Reservation reserve_on(int device, MemoryEstimate need);

  /// No more jobs for this device; returns whether all are closed.
  bool close_device(int device);
  [[nodiscard]] bool closed(int device) const;

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

  /// Counts more bytes of a reservation. Not refused where they exceed what is free: jobs that
  /// run would wait for those in the queue, which wait for them. New jobs are, until it has shrunk
  /// to the limit. Throws OutOfMemory (MESH_TOO_LARGE) when the whole could never fit.
  void grow(MemoryEstimate held, std::int64_t host_bytes);
  void release(MemoryEstimate bytes, int device);

  const MemoryBytes limit_;
  mutable std::mutex mutex_;
  MemoryBytes reserved_;
  DrainRate host_freed_;
  std::vector<DrainRate> device_freed_;
  std::vector<bool> closed_;  // by device
};

}  // namespace meshsmooth::server
