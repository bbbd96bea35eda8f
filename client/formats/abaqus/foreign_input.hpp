#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// Whether a keyword of Abaqus' or CalculiX' meshes starts a line of the text. O(text).
[[nodiscard]] bool has_deck_keyword(std::string_view text);

/// What a file of the extension .inp is when it is not a deck: "an AVS UCD file (…)"; none: it is
/// a deck, or not known. O(text).
[[nodiscard]] std::optional<std::string> name_foreign_input(std::string_view text);

}  // namespace meshsmooth::formats
