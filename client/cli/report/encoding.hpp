#pragma once

#include <bit>
#include <cstddef>
#include <filesystem>
#include <ranges>
#include <span>
#include <string>
#include <string_view>

namespace meshsmooth::cli {

/// The text for HTML's content and quoted attributes. Bytes that are no UTF-8 and control
/// characters become U+FFFD.
[[nodiscard]] std::string escape_html(std::string_view text);

/// The text as a JSON string with its quotes, which may stand in a <script> element: no '<', '>'
/// or '&' is left in it. Invalid bytes become U+FFFD.
[[nodiscard]] std::string json_string(std::string_view text);

/// A number for JSON; null where it is not finite.
[[nodiscard]] std::string json_number(double value);

/// The name of a file without its folders, which are nobody's business but the caller's.
[[nodiscard]] std::string file_name(const std::filesystem::path& path);

[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// A JSON string of the values as they lie in memory, little-endian.
template <std::ranges::contiguous_range Values>
[[nodiscard]] std::string json_array(const Values& values) {
  static_assert(std::endian::native == std::endian::little);
  return '"' + base64(std::as_bytes(std::span(values))) + '"';
}

}  // namespace meshsmooth::cli
