#pragma once

#include <mutex>
#include <utility>

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
      : ledger_(std::exchange(other.ledger_, nullptr)), bytes_(std::exchange(other.bytes_, {})) {}
  Reservation& operator=(Reservation&& other) noexcept {
    std::swap(ledger_, other.ledger_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~Reservation();

  [[nodiscard]] MemoryEstimate bytes() const { return bytes_; }

  /// Takes a part of it, at most all, as a promise of its own.
  [[nodiscard]] Reservation split(MemoryEstimate part);

 private:
  friend class Ledger;
  Reservation(Ledger* ledger, MemoryEstimate bytes) : ledger_(ledger), bytes_(bytes) {}

  Ledger* ledger_ = nullptr;
  MemoryEstimate bytes_;
};

/// Counts the bytes promised to jobs: the sum of the living reservations equals
/// the counter, always. The only place that says no for memory. Thread-safe.
class Ledger {
 public:
  explicit Ledger(MemoryEstimate limit) : limit_(limit) {}

  /// Throws OutOfMemory: MESH_TOO_LARGE ("need_bytes", "limit_bytes") when it
  /// could never fit; Busy: HOST_MEMORY_BUSY or DEVICE_MEMORY_BUSY when not now.
  [[nodiscard]] Reservation reserve(MemoryEstimate need);

  /// Throws as `reserve` does when it could never fit.
  void check_fits(MemoryEstimate need) const;

  [[nodiscard]] MemoryEstimate limit() const { return limit_; }
  [[nodiscard]] MemoryEstimate reserved() const;

 private:
  friend class Reservation;
  void give_back(MemoryEstimate bytes);

  const MemoryEstimate limit_;
  mutable std::mutex mutex_;
  MemoryEstimate reserved_;
  DrainRate host_freed_, device_freed_;
};

}  // namespace meshsmooth::server
