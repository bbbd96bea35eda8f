#include "classic_header.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// The header from its first byte on; whatever it skips must be in the file.
class Header {
 public:
  Header(const std::filesystem::path& path, std::string_view bytes)
      : path_(path), bytes_(bytes), version_(bytes[3]) {}

  void check() {
    skip(4, 1);
    const std::uint64_t records = count();
    (void)word();  // the tag of a list
    repeat(count(), [&] {
      skip_name();
      lengths_.push_back(count());
    });
    skip_attributes();
    (void)word();
    repeat(count(), [&] { read_variable(); });
    check_variables(records);
  }

 private:
  /// Where its values lie in the file; of one with records, those of the first.
  struct Variable {
    std::uint64_t begin;
    std::uint64_t bytes;
    bool has_records;
  };

  std::uint64_t number(std::uint64_t width) {
    std::uint64_t value = 0;
    const std::size_t begin = at_;
    skip(width, 1);
    for (const char byte : bytes_.substr(begin, width)) {
      value = value << 8U | static_cast<unsigned char>(byte);
    }
    return value;
  }
  std::uint64_t word() { return number(4); }
  std::uint64_t count() { return number(version_ == 5 ? 8 : 4); }

  void skip(std::uint64_t how_many, std::uint64_t size) {
    const std::uint64_t left = bytes_.size() - at_;
    if (how_many > left / size) {
      fail("FILE_TRUNCATED", path_,
           "the header of the netCDF file tells at byte " + std::to_string(at_) + " of " +
               std::to_string(how_many) + " values, which are more than the file holds");
    }
    at_ += static_cast<std::size_t>(how_many * size);
  }
  void skip_padded(std::uint64_t how_many, std::uint64_t size) {
    skip(how_many, size);
    skip((4 - how_many * size % 4) % 4, 1);
  }
  void skip_name() { skip_padded(count(), 1); }

  /// Every element of a list has some bytes, so that a count that is too high ends with the file.
  template <class Action>
  void repeat(std::uint64_t how_many, const Action& action) {
    for (std::uint64_t n = 0; n < how_many; ++n) action();
  }

  void skip_attributes() {
    (void)word();
    repeat(count(), [&] {
      skip_name();
      const std::uint64_t size = size_of(word());
      skip_padded(count(), size == 0 ? 1 : size);
    });
  }

  void read_variable() {
    skip_name();
    Variable variable{.begin = 0, .bytes = 1, .has_records = false};
    bool first = true;
    repeat(count(), [&] {
      const std::uint64_t id = count();
      const std::uint64_t length = id < lengths_.size() ? lengths_[id] : 1;
      // The library divides by the product of the lengths.
      if (length == 0 && !first) refuse("has records in a dimension that is not its first");
      if (length == 0) {
        variable.has_records = true;
      } else {
        variable.bytes = product(variable.bytes, length);
      }
      first = false;
    });
    skip_attributes();
    const std::uint64_t size = size_of(word());
    if (size == 0) refuse("has an unknown type");
    variable.bytes = product(variable.bytes, size);
    (void)count();  // its size once more, which need not be right
    variable.begin = number(version_ == 1 ? 4 : 8);
    variables_.push_back(variable);
  }

  [[noreturn]] void refuse(const std::string& what) const {
    fail("FORMAT_ERROR", path_,
         "a variable in the header of the netCDF file, before byte " + std::to_string(at_) + ", " +
             what);
  }

  /// The library fills up a file whose values it does not hold, to any length, when it writes it.
  void check_variables(std::uint64_t records) const {
    const auto with_records = std::ranges::count_if(variables_, &Variable::has_records);
    std::uint64_t record_bytes = 0;
    for (const Variable& variable : variables_) {
      if (!variable.has_records) continue;
      const std::uint64_t bytes = variable.bytes;
      record_bytes = sum(record_bytes, with_records == 1 ? bytes : sum(bytes, (4 - bytes % 4) % 4));
    }
    for (const auto& [begin, bytes, has_records] : variables_) {
      if (bytes == 0 || (has_records && records == 0)) continue;
      const std::uint64_t last = has_records ? product(records - 1, record_bytes) : 0;
      if (sum(sum(begin, last), bytes) <= bytes_.size()) continue;
      fail("FILE_TRUNCATED", path_,
           "the netCDF file ends before the values that its header tells of" +
               (has_records ? ", of " + std::to_string(records) + " records" : ""));
    }
  }

  // Of numbers that the file says: the highest number where the result is beyond it.
  static std::uint64_t sum(std::uint64_t a, std::uint64_t b) {
    return a > kMost - b ? kMost : a + b;
  }
  static std::uint64_t product(std::uint64_t a, std::uint64_t b) {
    return b != 0 && a > kMost / b ? kMost : a * b;
  }

  /// Of a value; 0: there is no such type.
  static std::uint64_t size_of(std::uint64_t type) {
    constexpr std::array<std::uint64_t, 12> kSizes = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    return type < kSizes.size() ? kSizes[type] : 0;
  }

  const std::filesystem::path& path_;
  std::string_view bytes_;
  char version_;
  std::size_t at_ = 0;
  std::vector<std::uint64_t> lengths_;  // of the dimensions; 0: as many as there are records
  std::vector<Variable> variables_;

  static constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
};

}  // namespace

void check_classic_header(const std::filesystem::path& path, std::string_view bytes) {
  if (bytes.size() < 4 || !bytes.starts_with("CDF")) return;
  if (bytes[3] == 1 || bytes[3] == 2 || bytes[3] == 5) Header(path, bytes).check();
}

}  // namespace meshsmooth::formats
