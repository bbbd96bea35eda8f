#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "text.hpp"

namespace meshsmooth::formats::unv {

/// The numbers of a line of up to eight integers in fields of ten columns.
struct Integers {
  std::array<std::int64_t, 8> values{};
  std::size_t count = 0;

  [[nodiscard]] std::int64_t operator[](std::size_t field) const { return values[field]; }
  [[nodiscard]] std::int64_t last() const { return values[count - 1]; }
};

/// Walks over the lines of a universal file, whose data sets are between lines of "-1".
class Lines {
 public:
  Lines(const std::filesystem::path& path, std::string_view text)
      : text_(text), scanner_(path, text) {}

  /// At the first line of the next data set, which is its number; false: there are no more.
  bool next_data_set();
  /// At the next record of this data set; false: it has ended, and the line of "-1" is passed.
  bool more();
  /// The file ends in a data set.
  [[nodiscard]] bool is_unfinished() const { return unfinished_; }

  [[nodiscard]] std::string_view peek() const { return scanner_.peek_line(); }
  std::string_view take() { return scanner_.line(); }
  /// As `more`, for the middle of a record, which has to go on.
  void require_more(const std::string& what);
  void skip_bytes(std::size_t count) { scanner_.bytes(count); }
  /// The numbers of this line.
  [[nodiscard]] Integers integers() const;
  /// Those of the line after this one; none where it has other texts.
  [[nodiscard]] Integers integers_of_next_line() const;
  [[nodiscard]] const Scanner& scanner() const { return scanner_; }
  [[nodiscard]] std::string_view text() const { return text_; }

 private:
  [[nodiscard]] bool at_end() const { return scanner_.position() >= text_.size(); }
  void skip_blank_lines();

  std::string_view text_;
  Scanner scanner_;
  bool unfinished_ = false;
};

/// The words of a line; at most `kMost` are stored and one more is counted.
struct Words {
  static constexpr std::size_t kMost = 9;
  std::array<std::string_view, kMost> words{};
  std::size_t count = 0;
};
[[nodiscard]] Words split(std::string_view line);

}  // namespace meshsmooth::formats::unv
