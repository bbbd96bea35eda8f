#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace meshsmooth::formats {

/// Finds the place of a tag in a list. Tags that are nearly consecutive, as most programs write
/// them, take an array instead of a hash map.
class TagIndex {
 public:
  /// O(tags).
  explicit TagIndex(std::span<const std::int64_t> tags) {
    if (tags.empty()) return;
    const auto [least, greatest] = std::ranges::minmax(tags);
    const std::uint64_t range =
        static_cast<std::uint64_t>(greatest) - static_cast<std::uint64_t>(least);
    least_ = static_cast<std::uint64_t>(least);
    if (range / 4 <= tags.size()) {
      places_.assign(static_cast<std::size_t>(range) + 1, kNone);
    } else {
      map_.reserve(tags.size());
    }
    for (std::size_t place = 0; place < tags.size(); ++place) {
      const bool is_new = places_.empty() ? map_.emplace(tags[place], place).second
                                          : put(places_[offset(tags[place])], place);
      if (!is_new && !repeated_) repeated_ = tags[place];
    }
  }

  /// The first place of the tag. O(1).
  [[nodiscard]] std::optional<std::size_t> find(std::int64_t tag) const {
    if (places_.empty()) {
      const auto found = map_.find(tag);
      return found == map_.end() ? std::nullopt : std::optional(found->second);
    }
    const std::size_t at = offset(tag);
    if (at >= places_.size() || places_[at] == kNone) return std::nullopt;
    return places_[at];
  }
  /// A tag that is there twice.
  [[nodiscard]] const std::optional<std::int64_t>& repeated() const { return repeated_; }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  static bool put(std::size_t& where, std::size_t place) {
    if (where != kNone) return false;
    where = place;
    return true;
  }
  [[nodiscard]] std::size_t offset(std::int64_t tag) const {
    return static_cast<std::size_t>(static_cast<std::uint64_t>(tag) - least_);
  }

  std::uint64_t least_ = 0;
  std::vector<std::size_t> places_;
  std::unordered_map<std::int64_t, std::size_t> map_;
  std::optional<std::int64_t> repeated_;
};

}  // namespace meshsmooth::formats
