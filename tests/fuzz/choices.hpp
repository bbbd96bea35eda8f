#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace meshsmooth::testing {

/// Reads a fuzzer's bytes as choices of a grammar; when they are used up, every
/// choice is 0, so that each string of bytes is a whole sentence.
class Choices {
 public:
  explicit Choices(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }

  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t value = rest_.front();
    rest_ = rest_.subspan(1);
    return value;
  }
  bool flag() { return (byte() & 1) != 0; }
  /// From 0 to `count` - 1; `count` is at most 256.
  std::size_t below(std::size_t count) { return count == 0 ? 0 : byte() % count; }

  /// Small ones often, the ends of the types too, any other by its eight bytes.
  std::int64_t number() {
    static constexpr std::int64_t kEnds[] = {-1,
                                             INT32_MAX,
                                             INT32_MIN,
                                             std::int64_t{INT32_MAX} + 1,
                                             std::int64_t{UINT32_MAX},
                                             std::int64_t{UINT32_MAX} + 1,
                                             INT64_MAX,
                                             INT64_MIN,
                                             INT64_MAX / 2,
                                             INT64_MAX / 8,
                                             INT64_MAX / 24,
                                             INT64_MAX / 32 + 1};
    const std::uint8_t kind = byte();
    if (kind < 224) return kind;
    if (kind < 224 + std::size(kEnds)) return kEnds[kind - 224];
    return std::bit_cast<std::int64_t>(raw<std::uint64_t>());
  }

  double real() {
    static constexpr double kEnds[] = {0.0,
                                       -0.0,
                                       1.0,
                                       -1.0,
                                       0.5,
                                       1e-300,
                                       1e300,
                                       -1e300,
                                       std::numeric_limits<double>::infinity(),
                                       -std::numeric_limits<double>::infinity(),
                                       std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::denorm_min(),
                                       9.3e18};
    const std::uint8_t kind = byte();
    if (kind < std::size(kEnds)) return kEnds[kind];
    if (kind < 200) return (kind - 100) / 64.0;
    return std::bit_cast<double>(raw<std::uint64_t>());
  }

  std::string text(std::size_t longest) {
    const std::size_t wanted = below(longest + 1);  // itself a byte of the rest
    const std::size_t size = std::min(wanted, rest_.size());
    std::string text(reinterpret_cast<const char*>(rest_.data()), size);
    rest_ = rest_.subspan(size);
    return text;
  }
  std::string rest() {
    std::string text(reinterpret_cast<const char*>(rest_.data()), rest_.size());
    rest_ = {};
    return text;
  }

 private:
  template <class T>
  T raw() {
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) value |= T{byte()} << (8 * i);
    return value;
  }

  std::span<const std::uint8_t> rest_;
};

/// What holds for every input; stops the program where it does not. Not an
/// assert: it is there in every build.
inline void require(bool holds, std::string_view what) {
  if (holds) return;
  std::cerr << "the fuzz target's own check failed: " << what << std::endl;
  std::abort();
}

}  // namespace meshsmooth::testing
