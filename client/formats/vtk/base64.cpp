#include "vtk/base64.hpp"

#include <array>
#include <cstdint>

namespace meshsmooth::formats {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr auto kValues = [] {
  std::array<std::int8_t, 256> values{};
  values.fill(-1);
  for (std::size_t value = 0; value < kDigits.size(); ++value) {
    values[static_cast<unsigned char>(kDigits[value])] = static_cast<std::int8_t>(value);
  }
  return values;
}();

}  // namespace

std::string encode_base64(std::string_view bytes) {
  std::string text;
  text.reserve(base64_length(bytes.size()));
  for (std::size_t begin = 0; begin < bytes.size(); begin += 3) {
    const std::string_view part = bytes.substr(begin, 3);
    std::uint32_t bits = 0;
    for (std::size_t place = 0; place < 3; ++place) {
      bits = bits << 8 | (place < part.size() ? static_cast<unsigned char>(part[place]) : 0U);
    }
    for (std::size_t place = 0; place < 4; ++place) {
      text += place > part.size() ? '=' : kDigits[bits >> (18 - 6 * place) & 63U];
    }
  }
  return text;
}

std::optional<std::string> decode_base64(std::string_view text, std::size_t count) {
  if (count / 3 * 4 > text.size()) return std::nullopt;
  std::string bytes;
  bytes.reserve(count + 2);
  std::uint32_t bits = 0;
  for (std::size_t place = 0; bytes.size() < count; ++place) {
    if (place == text.size()) return std::nullopt;
    const std::int8_t value = kValues[static_cast<unsigned char>(text[place])];
    if (value < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    // A byte is complete with the second, third and fourth character of four.
    if (place % 4 != 0) bytes += static_cast<char>(bits >> (6 - 2 * (place % 4)) & 255U);
  }
  return bytes;
}

}  // namespace meshsmooth::formats
