#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// Counts how often each key of a row occurs; emptied in O(1), grows with its row.
template <class Key>
class RowCounter {
 public:
  struct Slot {
    Key key;
    std::uint32_t epoch;
    std::uint32_t count;
  };

  /// Empties it; at most `capacity` different keys will come.
  void clear(std::size_t capacity) {
    if (slots_.size() < 2 * capacity) {
      slots_.assign(std::bit_ceil(std::max<std::size_t>(2 * capacity, 256)), Slot{});
      shift_ = 64 - std::countr_zero(slots_.size());
      epoch_ = 0;
    }
    if (++epoch_ == 0) {
      std::fill(slots_.begin(), slots_.end(), Slot{});
      epoch_ = 1;
    }
    used_.resize(std::max(used_.size(), capacity));
    size_ = 0;
  }

  void add(Key key) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = (bits(key) * 0x9e3779b97f4a7c15U) >> shift_;; at = (at + 1) & mask) {
      Slot& slot = slots_[at];
      if (slot.epoch != epoch_) {
        slot = {key, epoch_, 1};
        used_[size_++] = static_cast<std::uint32_t>(at);
        return;
      }
      if (slot.key == key) {
        ++slot.count;
        return;
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  /// The n-th different key, in the order of their coming.
  [[nodiscard]] const Slot& operator[](std::size_t n) const { return slots_[used_[n]]; }

 private:
  static std::uint64_t bits(NodeId node) { return static_cast<std::uint64_t>(node); }
  template <class Facet>
  static std::uint64_t bits(const Facet& facet) {
    return facet.first_two ^ (static_cast<std::uint64_t>(facet.third) << 16);
  }

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> used_;
  std::size_t size_ = 0;
  std::uint32_t epoch_ = 0;
  int shift_ = 0;
};

}  // namespace meshsmooth::detail
