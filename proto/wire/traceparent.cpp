#include "wire/traceparent.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace meshsmooth::wire {
namespace {

bool is_hex(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool is_zero(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c == '0'; });
}

}  // namespace

bool is_traceparent(std::string_view text) {
  constexpr std::size_t kSize = 55;
  constexpr std::size_t kLongest = 128;  // of later versions, as it goes into logs
  if (text.size() < kSize || text.size() > kLongest) return false;
  const std::string_view version = text.substr(0, 2);
  const std::string_view trace = text.substr(3, 32);
  const std::string_view parent = text.substr(36, 16);
  const std::string_view flags = text.substr(53, 2);
  if (text[2] != '-' || text[35] != '-' || text[52] != '-') return false;
  if (!is_hex(version) || !is_hex(trace) || !is_hex(parent) || !is_hex(flags)) return false;
  if (version == "ff" || is_zero(trace) || is_zero(parent)) return false;
  if (text.size() == kSize) return true;
  const bool printable =
      std::ranges::all_of(text, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  return version != "00" && text[kSize] == '-' && printable;
}

}  // namespace meshsmooth::wire
