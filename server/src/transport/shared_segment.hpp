#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "memory_budget.hpp"
#include "meshsmooth/staging_memory.hpp"
#include "wire/descriptor.hpp"

namespace meshsmooth::server {

/// Memory that is shared with one caller: an anonymous file, mapped here. The caller may write into
/// it at any time, so whatever is read of it is copied first, once. It can neither shrink nor, once
/// sealed, lose pages: reading it never raises SIGBUS. Thread-safe.
class SharedSegment {
 public:
  using Clock = std::chrono::steady_clock;

  /// Reserves address space only. `size_bytes` are whole pages. Throws Error (OPTION_NOT_SUPPORTED)
  /// where the kernel lacks something.
  SharedSegment(std::string name, std::string caller, std::int64_t size_bytes,
                Reservation reservation);
  ~SharedSegment();
  SharedSegment(const SharedSegment&) = delete;
  SharedSegment& operator=(const SharedSegment&) = delete;

  /// Whether this system has all that segments need. Makes one to find out.
  [[nodiscard]] static bool supported();
  /// At least so many bytes in whole pages.
  [[nodiscard]] static std::int64_t whole_pages(std::int64_t bytes);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& caller() const { return caller_; }
  [[nodiscard]] std::span<std::byte> bytes() const { return bytes_; }
  [[nodiscard]] std::int64_t size_bytes() const { return static_cast<std::int64_t>(bytes_.size()); }

  /// The descriptor for the caller, once; an open file description of its own, by which
  /// `in_foreign_use` tells it from ours.
  [[nodiscard]] wire::Descriptor take_foreign_descriptor() { return std::move(foreign_); }
  /// From now on nobody can map it for writing anew, punch holes into it or write to the file; maps
  /// that exist stay writable. Throws Error.
  void seal();
  [[nodiscard]] bool sealed() const { return sealed_; }
  /// Prefaults the pages of a part.
  void populate(std::span<std::byte> part) const;
  /// Lets devices read and write it by themselves, where its pages can be locked; `pages` has no
  /// functions where they need not be.
  void open_to_devices(const StagingMemory::PageLock& pages);
  [[nodiscard]] bool open_to_devices() const { return open_to_devices_; }
  /// Whether another process still has it open or mapped, descriptors under way included.
  [[nodiscard]] bool in_foreign_use() const;

  // --- uses by calls ---------------------------------------------------------------

  /// A part that a call has in it; it counts as used until the last copy is gone.
  [[nodiscard]] static std::shared_ptr<SharedSegment> use(
      const std::shared_ptr<SharedSegment>& segment);
  [[nodiscard]] bool used() const { return use_count_ > 0; }
  /// Since the last use ended; 0 while it is used.
  [[nodiscard]] Clock::duration idle_for(Clock::time_point now) const;

  /// Whether the caller has been told that jobs may name it.
  [[nodiscard]] bool advertised() const { return advertised_; }
  void set_advertised() { advertised_ = true; }
  /// Whether the caller has been, or is to be, asked to return it.
  [[nodiscard]] bool recalled() const { return recalled_; }
  void recall() { recalled_ = true; }

 private:
  const std::string name_, caller_;
  const Reservation reservation_;  // released last
  wire::Descriptor own_, foreign_;
  std::span<std::byte> bytes_;
  std::function<void(void*)> unlock_;
  std::atomic<bool> sealed_ = false, advertised_ = false, recalled_ = false;
  std::atomic<bool> open_to_devices_ = false;
  std::atomic<int> use_count_ = 0;
  std::atomic<Clock::time_point> last_used_;
};

}  // namespace meshsmooth::server
