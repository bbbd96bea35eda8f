#pragma once

#include <charconv>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {

/// The whole file, be it a pipe or "-" (standard input); what gzip compressed is decompressed.
/// Throws FILE_NOT_FOUND, FILE_NOT_READABLE, and FORMAT_ERROR or FILE_TRUNCATED of gzip's data.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path);

/// Throws FILE_NOT_WRITABLE.
void write_bytes(const std::filesystem::path& path, std::string_view bytes);

/// Without blanks before and behind.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// `text` with each `from` replaced by `to`.
[[nodiscard]] std::string replaced(std::string text, const std::string& from,
                                   const std::string& to);

/// Throws `Error`: "PATH: what".
[[noreturn]] void fail(const std::string& reason, const std::filesystem::path& path,
                       const std::string& what);

/// Throws `InvalidOption` (NAME_UNKNOWN) that says what is not called so, and what there is.
[[noreturn]] void fail_unknown_name(const std::string& what_is_called, const std::string& name,
                                    const std::vector<std::string>& there_are);

/// Walks over a text and knows where it is. All that looks past the end throws
/// FILE_TRUNCATED, all that finds something else than asked FORMAT_ERROR, both
/// with path and line.
class Scanner {
 public:
  /// Texts after `comment` up to the end of the line are no tokens; 0: none. Begins behind a byte
  /// order mark.
  Scanner(std::filesystem::path path, std::string_view text, char comment = 0);

  /// The next token on any line.
  std::string_view token();
  /// The next token on this line; empty at its end.
  std::string_view token_on_line();
  /// The rest of this line without its end; moves to the next line.
  std::string_view line();
  /// The same, without moving.
  [[nodiscard]] std::string_view peek_line() const;
  /// Bytes of a binary section.
  std::string_view bytes(std::size_t count);

  template <class T>
  T number() {
    return parse<T>(token());
  }
  /// For sizes: not negative and not more than the file could hold.
  std::size_t count();

  template <class T>
  T parse(std::string_view word) const {
    T value{};
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size()) refuse("a number", word);
    return value;
  }

  [[nodiscard]] bool at_end();
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t offset_of(std::string_view word) const {
    return static_cast<std::size_t>(word.data() - text_.data());
  }
  [[noreturn]] void refuse(std::string_view expected, std::string_view found) const;
  [[noreturn]] void truncated() const;

 private:
  void skip_space(bool over_lines);
  [[nodiscard]] std::string where() const;

  std::filesystem::path path_;
  std::string_view text_;
  char comment_;
  std::size_t position_ = 0;
};

}  // namespace meshsmooth::formats
