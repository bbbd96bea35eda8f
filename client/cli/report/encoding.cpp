#include "report/encoding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace meshsmooth::cli {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

/// Takes the first character off `text`.
char32_t take_character(std::string_view& text) {
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
  const unsigned char first = byte(0);
  const int length = first < 0x80 ? 1 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  char32_t code = length == 1 ? first : first & (0x7F >> length);
  std::size_t used = 1;
  while (used < static_cast<std::size_t>(length) && used < text.size() &&
         (byte(used) & 0xC0) == 0x80) {
    code = code << 6 | (byte(used++) & 0x3F);
  }
  static constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool valid = first < 0xF8 && used == static_cast<std::size_t>(length) &&
                     code >= kLeast[length] && code <= 0x10FFFF &&
                     (code < 0xD800 || code > 0xDFFF) && (length > 1 || first < 0x80);
  text.remove_prefix(used);
  const bool control = code < 0x20 && code != '\t' && code != '\n';
  return !valid || control || code == 0x7F ? kReplacement : code;
}

void append_utf8(std::string& text, char32_t code) {
  const auto tail = [&](int shift) { text += static_cast<char>(0x80 | (code >> shift & 0x3F)); };
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xC0 | code >> 6);
    tail(0);
  } else if (code < 0x10000) {
    text += static_cast<char>(0xE0 | code >> 12);
    tail(6);
    tail(0);
  } else {
    text += static_cast<char>(0xF0 | code >> 18);
    tail(12);
    tail(6);
    tail(0);
  }
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string html;
  while (!text.empty()) {
    const char32_t code = take_character(text);
    if (code < 0x80 &&
        std::string_view("&<>\"'`").find(static_cast<char>(code)) != std::string_view::npos) {
      html += fmt::format("&#{};", static_cast<std::uint32_t>(code));
    } else {
      append_utf8(html, code);
    }
  }
  return html;
}

std::string json_string(std::string_view text) {
  std::string json = "\"";
  while (!text.empty()) {
    const char32_t code = take_character(text);
    // The last two end a line in older JavaScript.
    const bool escaped = code < 0x20 || code == '"' || code == '\\' || code == '<' || code == '>' ||
                         code == '&' || code == 0x2028 || code == 0x2029;
    if (escaped) {
      json += fmt::format("\\u{:04x}", static_cast<std::uint32_t>(code));
    } else {
      append_utf8(json, code);
    }
  }
  return json + '"';
}

std::string json_number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : "null";
}

std::string file_name(const std::filesystem::path& path) { return path.filename().string(); }

std::string base64(std::span<const std::byte> bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(4 * ((bytes.size() + 2) / 3));
  for (std::size_t first = 0; first < bytes.size(); first += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - first);
    std::uint32_t bits = 0;
    for (std::size_t n = 0; n < 3; ++n) {
      bits = bits << 8 | (n < count ? std::to_integer<std::uint32_t>(bytes[first + n]) : 0);
    }
    for (std::size_t n = 0; n < 4; ++n) {
      text += n <= count ? kDigits[bits >> (18 - 6 * n) & 63] : '=';
    }
  }
  return text;
}

}  // namespace meshsmooth::cli
