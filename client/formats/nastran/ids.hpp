#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace meshsmooth::formats {

/// Finds what has an id. Dense where ids are, else by bisection.
class IdIndex {
 public:
  IdIndex() = default;
  /// Of `count` things by their ids; of two with the same id the first counts. O(count log count).
  explicit IdIndex(std::span<const std::int64_t> ids);

  /// Its place among the ids. O(1) or O(log count).
  [[nodiscard]] std::optional<std::size_t> find(std::int64_t id) const;
  /// Those with an id from `first` to `last`, appended in ascending order. O(log count + found).
  void append_range(std::int64_t first, std::int64_t last, std::vector<std::int64_t>& ids) const;

 private:
  struct Row {
    std::int64_t id;
    std::size_t place;
  };
  std::vector<std::uint32_t> dense_;  // by id, the place + 1; or empty
  std::vector<Row> rows_;             // ascending; or empty
};

/// Ids as sets have them: "1, 5 THRU 20 EXCEPT 7, 30 THRU 40 BY 2, ALL".
class IdList {
 public:
  /// False: a word is neither an id nor one of those.
  bool add_words(std::span<const std::string_view> words);
  void add(std::int64_t id) { ranges_.push_back({id, id, 1}); }
  /// Those that exist.
  [[nodiscard]] std::vector<std::int64_t> ids_in(const IdIndex& index) const;

 private:
  struct Range {
    std::int64_t first;
    std::int64_t last;
    std::int64_t step;
  };
  std::vector<Range> ranges_;
  std::vector<std::int64_t> exceptions_;
};

}  // namespace meshsmooth::formats
