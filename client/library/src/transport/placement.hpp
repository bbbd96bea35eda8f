#pragma once

#include <cstddef>

#include "transport/transfer.hpp"

namespace meshsmooth::client {

/// Puts arrays into memory contiguously, around a part of it that is kept.
class Placement {
 public:
  static constexpr std::size_t kAlignment = Transfer::kAlignment;

  /// @param kept  from its first byte to behind its last.
  Placement(std::size_t kept_begin, std::size_t kept_end) : begin_(kept_begin), end_(kept_end) {}

  /// @returns where an array of so many bytes begins.
  std::size_t place(std::size_t bytes) {
    std::size_t at = aligned(used_);
    if (at < end_ && at + bytes > begin_) at = aligned(end_);
    used_ = at + bytes;
    return at;
  }
  /// The bytes up to the end of the last array.
  [[nodiscard]] std::size_t used() const { return used_; }

 private:
  static std::size_t aligned(std::size_t offset) {
    return (offset + kAlignment - 1) / kAlignment * kAlignment;
  }

  const std::size_t begin_, end_;
  std::size_t used_ = 0;
};

}  // namespace meshsmooth::client
