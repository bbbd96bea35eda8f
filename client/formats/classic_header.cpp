#include "classic_header.hpp"

#include <array>
#include <cstdint>
#include <string>

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
    (void)count();  // of records
    (void)word();   // the tag of a list
    repeat(count(), [&] {
      skip_name();
      (void)count();  // its length
    });
    skip_attributes();
    (void)word();
    repeat(count(), [&] { skip_variable(); });
  }

 private:
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
      const std::uint64_t type = word();
      skip_padded(count(), size_of(type));
    });
  }

  void skip_variable() {
    skip_name();
    skip(count(), version_ == 5 ? 8 : 4);  // its dimensions
    skip_attributes();
    (void)word();                         // its type
    (void)count();                        // its size
    (void)number(version_ == 1 ? 4 : 8);  // where it begins
  }

  /// Of a value; of an unknown type the library says so.
  static std::uint64_t size_of(std::uint64_t type) {
    constexpr std::array<std::uint64_t, 12> kSizes = {1, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    return type < kSizes.size() ? kSizes[type] : 1;
  }

  const std::filesystem::path& path_;
  std::string_view bytes_;
  char version_;
  std::size_t at_ = 0;
};

}  // namespace

void check_classic_header(const std::filesystem::path& path, std::string_view bytes) {
  if (bytes.size() < 4 || !bytes.starts_with("CDF")) return;
  if (bytes[3] == 1 || bytes[3] == 2 || bytes[3] == 5) Header(path, bytes).check();
}

}  // namespace meshsmooth::formats
