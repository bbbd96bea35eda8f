#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// Characters of a stream of as many bytes, with its padding.
[[nodiscard]] constexpr std::size_t base64_length(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

[[nodiscard]] std::string encode_base64(std::string_view bytes);

/// The first `count` bytes of the stream that the text begins with. None: it has fewer.
[[nodiscard]] std::optional<std::string> decode_base64(std::string_view text, std::size_t count);

}  // namespace meshsmooth::formats
