#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "text.hpp"

namespace meshsmooth::formats {

/// What $MeshFormat says; a file without it is of version 1.0.
struct MshFormat {
  int version = 10;  // 10, 20, 21, 22, 30, 40, 41
  bool binary = false;
  bool swapped = false;        // bytes: high ones first
  std::size_t size_bytes = 8;  // of counts and tags of a binary file of version 4.1

  bool operator==(const MshFormat&) const = default;
  /// Whether physical groups are of entities, not of elements.
  [[nodiscard]] bool has_entities() const { return version >= 30; }
};

/// Reads the numbers of an MSH file, which are words of a text or bytes.
class MshNumbers {
 public:
  MshNumbers(Scanner& scanner, std::size_t file_size, MshFormat format)
      : scanner_(scanner), file_size_(file_size), format_(format) {}

  [[nodiscard]] const MshFormat& format() const { return format_; }
  [[nodiscard]] bool binary() const { return format_.binary; }
  [[nodiscard]] Scanner& scanner() { return scanner_; }

  int integer() { return format_.binary ? value<std::int32_t>() : scanner_.number<int>(); }
  /// The number of a node or an element.
  std::int64_t tag() {
    if (!format_.binary) return scanner_.number<std::int64_t>();
    return format_.version < 41 ? value<std::int32_t>() : size();
  }
  /// How many things of at least `least_bytes` each follow.
  std::size_t count(std::size_t least_bytes = 1) {
    if (!format_.binary) return scanner_.count();
    return checked(static_cast<std::uint64_t>(size()), least_bytes);
  }
  /// The same of a binary file, or a number below zero.
  std::int64_t signed_count() {
    const auto number = value<std::int64_t>();
    return number < 0 ? number
                      : static_cast<std::int64_t>(checked(static_cast<std::uint64_t>(number), 1));
  }
  /// The same where a binary file has four bytes for it.
  std::size_t small_count(std::size_t least_bytes = 1) {
    if (!format_.binary) return scanner_.count();
    const std::int32_t number = value<std::int32_t>();
    if (number < 0) scanner_.refuse("a count", std::to_string(number));
    return checked(static_cast<std::uint64_t>(number), least_bytes);
  }
  /// The text or bytes of x, y and z.
  std::array<std::string_view, 3> coordinates() {
    std::array<std::string_view, 3> words;
    for (std::string_view& word : words) {
      word = format_.binary ? scanner_.bytes(sizeof(double)) : scanner_.token();
    }
    return words;
  }
  double real() { return format_.binary ? value<double>() : scanner_.number<double>(); }
  void skip_reals(std::size_t number) {
    for (std::size_t real = 0; real < number; ++real) {
      if (format_.binary) {
        scanner_.bytes(sizeof(double));
      } else {
        scanner_.token();
      }
    }
  }
  /// The first bytes of a section come after the line of its name.
  void end_of_name() {
    if (format_.binary) scanner_.line();
  }
  /// Of a record of a text: a number too many or too few shifts all that come after it.
  void end_of_record(std::string_view what, std::int64_t tag) {
    if (format_.binary) return;
    const std::string_view word = scanner_.token_on_line();
    if (word.empty()) return;
    scanner_.refuse("the end of the line of " + std::string(what) + " " + std::to_string(tag),
                    word);
  }
  /// Of record `index`, from 0, of those that a section announces: its first number. Says which
  /// record is the first that is missing where the section ends before.
  std::int64_t first_tag(std::string_view what, std::size_t index, std::size_t announced) {
    if (format_.binary) return tag();
    const std::string_view word = scanner_.token();
    if (word.starts_with('$')) {
      scanner_.refuse(std::string(what) + " " + std::to_string(index + 1) + " of the " +
                          std::to_string(announced) + " that the section announces",
                      word);
    }
    return scanner_.parse<std::int64_t>(word);
  }

 private:
  template <class T>
  T value() {
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), scanner_.bytes(sizeof(T)).data(), sizeof(T));
    if (format_.swapped) std::reverse(bytes.begin(), bytes.end());
    T result{};
    std::memcpy(&result, bytes.data(), sizeof(T));
    return result;
  }
  std::int64_t size() {
    if (format_.size_bytes == 4) return value<std::uint32_t>();
    return static_cast<std::int64_t>(value<std::uint64_t>());
  }
  std::size_t checked(std::uint64_t number, std::size_t least_bytes) {
    if (number > (file_size_ - scanner_.position()) / std::max<std::size_t>(least_bytes, 1)) {
      scanner_.truncated();
    }
    return static_cast<std::size_t>(number);
  }

  Scanner& scanner_;
  std::size_t file_size_;
  MshFormat format_;
};

}  // namespace meshsmooth::formats
